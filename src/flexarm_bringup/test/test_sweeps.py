"""Swept sines: whole records without a window where they end at rest, and what is told where they do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from flexarm_bringup.identify.averaging import Averaging, cut_of
from flexarm_bringup.identify.halves import judge_halves
from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.sources import of_records
from flexarm_bringup.identify.sweeps import swept_band

RATE, F_HZ, ZETA = 200.0, np.array([8.0, 9.0, 30.0]), np.array([0.01, 0.02, 0.01])
REQUEST = Request(None, 0.6)
SHAPES = np.array([[1.0, 0.8, -0.5], [0.6, -0.9, 0.7]])  # of two sensors
USUAL = Averaging()


def sine(seconds: float, low: float = 2.0, high: float = 50.0) -> np.ndarray:
    return np.asarray(signal.chirp(np.arange(round(seconds * RATE)) / RATE, low, seconds, high))


def sweep(seconds: float = 30.0, rest: float = 8.0, high: float = 50.0, noise: float = 0.001) -> Records:
    """Return a sweep from 2 Hz on, what two sensors say to it, and what rings on in the rest [s]."""
    x = np.append(sine(seconds, high=high), np.zeros(round(rest * RATE)))
    y = np.zeros((x.size, 2))
    for omega, zeta, shape in zip(2 * np.pi * F_HZ, ZETA, SHAPES.T, strict=True):
        plant = ([omega**2], [1.0, 2 * zeta * omega, omega**2])
        b, a, _ = signal.cont2discrete(plant, 1 / RATE, method="zoh")
        y += np.outer(signal.lfilter(b.ravel(), a, x), shape)
    y += noise * y.std() * np.random.default_rng(1).standard_normal(y.shape)
    return Records(RATE, {"F": x}, {"a": y[:, 0], "b": y[:, 1]}, "receptance", is_held=True)


def test_a_sweep_with_hardly_any_noise_gives_the_modes_put_in_without_an_option() -> None:
    """In blocks behind a window no mode stood out of the noise."""
    source = of_records([sweep()], USUAL)
    fit = identify(source, REQUEST).own_fit
    assert fit is not None and fit.model.f_hz == pytest.approx(F_HZ, rel=1e-4)
    assert fit.model.zeta == pytest.approx(ZETA, rel=0.01)
    assert source.responses.band_hz == pytest.approx((2.0, 50.0), abs=1.0)  # beyond it nothing was driven
    assert any("runs are taken whole, without a window" in line for line in source.remarks)


def test_a_sweep_is_not_judged_by_halves_of_other_frequencies() -> None:
    source = of_records([sweep()], USUAL)
    assert judge_halves(source, REQUEST, USUAL) is None
    assert any("no half of a record was predicted" in line for line in source.remarks)


def others(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Return signals that pass through no band once."""
    n = 6000
    white = rng.standard_normal(n)
    return {
        "noise": white,
        "drift": np.cumsum(white),
        "narrow noise": signal.lfilter(*signal.butter(2, [0.09, 0.1], "band"), white),
        "burst": np.append(white[:1500], np.zeros(n - 1500)),
        "sine": np.sin(2 * np.pi * 5.0 * np.arange(n) / RATE),
        "many sweeps": np.tile(sine(3.0), 10),
        "up and down": np.append(sine(15.0), sine(15.0)[::-1]),
        "ramp": np.linspace(0.0, 1.0, n),
        "gap": np.append(np.nan, white[1:]),
    }


@pytest.mark.parametrize("name", others(np.random.default_rng(0)))
def test_what_does_not_pass_through_a_band_once_is_no_sweep(name: str) -> None:
    for seed in range(10):
        x = others(np.random.default_rng(seed))[name]
        assert swept_band([Records(RATE, {"F": x}, {"a": x}, "receptance")]) is None


@pytest.mark.parametrize(
    ("x", "band"),
    [
        (sine(30.0), (2.0, 50.0)),
        (sine(30.0, 50.0, 2.0), (2.0, 50.0)),
        (np.concatenate([np.zeros(3000), sine(10.0, 5.0, 20.0), np.zeros(9000)]), (5.0, 20.0)),
        (np.sin(2 * np.pi * np.repeat(np.arange(5, 29), 200) * np.arange(4800) / RATE), (5.0, 28.0)),
    ],
    ids=["up", "down", "in a long record", "in steps"],
)
def test_a_sweep_is_known_by_its_one_way_through_a_band(x: np.ndarray, band: tuple[float, float]) -> None:
    for noise in (0.0, 0.03):
        noisy = x + noise * np.random.default_rng(0).standard_normal(x.size)
        found = swept_band([Records(RATE, {"F": noisy}, {"a": noisy}, "receptance")])
        assert found == pytest.approx(band, abs=1.1)


def test_sweeps_one_input_at_a_time_are_known_beside_noise_of_the_others() -> None:
    """Noise of 1e-4 on the force that rested made blocks of both runs, and their modes wrong."""
    noise = 1e-3 * np.random.default_rng(0).standard_normal((2, sine(30.0).size))
    runs = [
        Records(RATE, {"F": x, "G": y}, {"a": x}, "receptance")
        for x, y in ((sine(30.0), noise[0]), (noise[1], 40.0 * sine(30.0)))
    ]
    assert swept_band(runs) == pytest.approx((2.0, 50.0), abs=1.1)
    both = replace(
        runs[0], inputs={"F": sine(30.0), "G": 40.0 * np.random.default_rng(1).normal(size=noise[0].size)}
    )
    assert swept_band([both, runs[1]]) is None


def test_sweeps_and_hits_beside_other_inputs_are_told() -> None:
    """A run of noise beside two sweeps gave a damping of 1.45 instead of 1.2 % without a word."""
    x, noise = sine(30.0), np.random.default_rng(0).standard_normal((3, sine(30.0).size))
    swept = Records(RATE, {"F": x, "G": 0 * x}, {"a": x}, "receptance", file="swept.npz")
    shaken = replace(swept, inputs={"F": noise[0], "G": noise[1]}, file="")
    hit = replace(swept, inputs={"F": 0 * x, "G": np.eye(1, x.size, 50)[0]}, file="hit.npz")
    for runs, told in (
        ((swept, shaken), "neither: F of run 2, G of run 2; sweep: F of swept.npz; all are cut into blocks"),
        ((replace(swept, inputs={"F": x, "G": noise[0]}),), "neither: G of swept.npz; sweep: F of swept.npz"),
        ((swept, hit), "hit: G of hit.npz; sweep: F of swept.npz"),
    ):
        assert told in cut_of(runs, USUAL).remarks[0]
    moved = [replace(run, is_of_moves=True) for run in (swept, shaken)]
    asked = Averaging(RATE / x.size, "boxcar")
    for cut in (cut_of([shaken], USUAL), cut_of(moved, USUAL), cut_of([swept, shaken], asked)):
        assert not cut.remarks


def test_a_sweep_is_told_why_it_is_not_taken_whole() -> None:
    ended, two = sweep(), sweep()
    two = replace(two, inputs={"F": two.inputs["F"], "G": 2.0 * two.inputs["F"]})
    for run, averaging, why in (
        (ended, Averaging(resolution_hz=0.5), "leave --resolution and --window out"),
        (ended, Averaging(window="flattop"), "leave --resolution and --window out"),
        (two, USUAL, "1 run(s) taken whole cannot part 2 inputs"),
        (sweep(rest=0.0, high=30.0), USUAL, "still moving at the end: a, b; record on until all is at rest"),
    ):
        cut = cut_of([run], averaging)
        assert cut.settings.window != "boxcar" and why in cut.remarks[-1]


def test_a_sweep_in_noise_that_is_at_rest_at_its_end_is_taken_whole_and_one_cut_off_as_it_rings_is_not() -> (
    None
):
    """Cut off at 30 Hz it gave two modes, 29.17 +- 0.05 and 30.24 Hz, where there is one at 30 Hz."""
    for run, is_whole in ((sweep(noise=0.2), True), (sweep(rest=0.5, high=30.0), False)):
        assert (cut_of([run], USUAL).settings.window == "boxcar") is is_whole


def test_a_sweep_that_was_asked_for_whole_is_told_nothing_of_blocks() -> None:
    run = sweep(rest=0.0)
    cut = cut_of([run], Averaging(RATE / run.inputs["F"].size, "boxcar"))
    assert cut.band_hz is not None and not any("blocks" in line for line in cut.remarks)
