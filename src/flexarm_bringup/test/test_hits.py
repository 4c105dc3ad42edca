"""Hits of a hammer: whole records without a window, and a fit that leaves too much is no pass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from identify_files import F_HZ, ZETA
from scipy import signal

from flexarm_bringup.identify.averaging import Averaging, cut_of
from flexarm_bringup.identify.halves import judge_halves
from flexarm_bringup.identify.hits import are_hits
from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.page import build_page
from flexarm_bringup.identify.run import Request, Result, identify
from flexarm_bringup.identify.sources import Source, of_records

RATE = 200.0
REQUEST = Request((5.0, 45.0), 0.6)


def hit(seed: int, seconds: float) -> Records:
    """Return a hit of three samples and what two accelerometers say to it, with 0.1 % of noise."""
    rng = np.random.default_rng(seed)
    x = np.zeros(round(seconds * RATE))
    x[20:23] = (1 + 0.1 * seed) * np.array([0.3, 1.0, 0.5])
    y = np.zeros((x.size, 2))
    for k, (omega, zeta) in enumerate(zip(2 * np.pi * F_HZ, ZETA, strict=True)):
        b, a, _ = signal.cont2discrete(
            ([1.0, 0.0, 0.0], [1.0, 2 * zeta * omega, omega**2]), 1 / RATE, method="bilinear"
        )
        y += np.outer(signal.lfilter(b.ravel(), a, x), [1.0, 0.7 - k])
    y += 0.001 * abs(y).max() * rng.standard_normal(y.shape)
    return Records(RATE, {"hammer": x}, {"a": y[:, 0], "b": y[:, 1]}, "accelerance")


def identified(averaging: Averaging, seconds: float = 10.0) -> tuple[Source, Result]:
    source = of_records([hit(seed, seconds) for seed in range(4)], averaging)
    return source, identify(source, REQUEST)


def test_hits_give_the_modes_put_in_without_an_option() -> None:
    """Behind a Hann window of a part of the record they gave none, or wrong ones, without a warning."""
    source, result = identified(Averaging())
    fit = result.found.fit
    analogue = 2 * np.pi * F_HZ * (-ZETA + 1j * np.sqrt(1 - ZETA**2))
    poles = RATE * np.log((2 * RATE + analogue) / (2 * RATE - analogue))  # where the bilinear filter has them
    assert fit is not None and fit.model.f_hz == pytest.approx(abs(poles) / (2 * np.pi), rel=1e-4)
    assert fit.model.zeta == pytest.approx(-poles.real / abs(poles), rel=0.005)
    assert any("2000 samples without a window" in line for line in source.remarks)
    assert not any("is left at the end" in line for line in source.remarks)
    assert judge_halves(source, REQUEST, Averaging()) is None


def in_one(runs: Sequence[Records]) -> Records:
    """Return runs one after the other, their hits equally hard."""

    def joined(kind: str, name: str) -> np.ndarray:
        """Return a channel of all runs."""
        return np.concatenate([getattr(run, kind)[name] / run.inputs["hammer"].max() for run in runs])

    outputs = {name: joined("outputs", name) for name in runs[0].outputs}
    return replace(runs[0], inputs={"hammer": joined("inputs", "hammer")}, outputs=outputs)


def test_even_hits_in_one_record_give_the_modes_that_they_give_apart() -> None:
    """Four hits in a row are a comb, whose lines between had no input: no mode stood out of the noise."""
    runs = [hit(seed, 10.0) for seed in range(4)]
    apart, together = (
        identify(of_records(of, Averaging()), REQUEST).found.fit for of in (runs, [in_one(runs)])
    )
    assert apart is not None and together is not None
    assert together.model.f_hz == pytest.approx(apart.model.f_hz, rel=1e-4)
    assert together.model.zeta == pytest.approx(apart.model.zeta, rel=0.01)


def test_a_record_is_cut_at_hits_before_which_all_is_at_rest() -> None:
    runs = [hit(seed, 10.0) for seed in range(3)]
    cut = cut_of([in_one(runs)], Averaging())
    assert [int(run.inputs["hammer"].argmax()) for run in cut.runs] == [21, 21, 21]
    assert (
        cut.settings.block == cut.used == 2000 and "1 run(s) are cut at their hits into 3" in cut.remarks[-1]
    )
    bounced = {"hammer": runs[0].inputs["hammer"] + 0.5 * np.roll(runs[0].inputs["hammer"], 30)}
    whole = [replace(runs[0], inputs=bounced)]
    for kept, averaging in ((runs, Averaging()), (whole, Averaging()), ([in_one(runs)], Averaging(0.5))):
        cut = cut_of(kept, averaging)
        assert list(cut.runs or kept) == kept and not any("at their hits" in line for line in cut.remarks)


def test_hits_of_two_hammers_in_one_record_are_two_runs() -> None:
    """One run without a window could not part two inputs."""
    run = in_one([hit(0, 10.0), hit(1, 10.0)])
    first = np.arange(run.inputs["hammer"].size) < 2000
    both = {name: run.inputs["hammer"] * at for name, at in (("one", first), ("two", ~first))}
    assert len(cut_of([replace(run, inputs=both)], Averaging()).runs) == 2


def test_hits_that_cannot_be_told_apart_are_told() -> None:
    ringing, close = in_one([hit(0, 2.0), hit(1, 2.0)]), in_one([hit(0, 1.5), hit(1, 1.5)])
    for run, why in ((ringing, "still moving 384 samples after a hit: a, b"), (close, "fewer than 384")):
        cut = cut_of([run], Averaging())
        assert why in cut.remarks[-1] and cut.settings.block == run.inputs["hammer"].size


def test_lines_without_input_between_hits_that_still_ring_do_not_count() -> None:
    """Responses there are noise divided by nothing: hits in a row ended in an error of the fit."""
    one = hit(0, 20.0)

    def again(signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return what four hits a few seconds apart give."""
        return {name: sum(np.roll(x, 450 * k) for k in range(4)) for name, x in signals.items()}

    source = of_records([replace(one, inputs=again(one.inputs), outputs=again(one.outputs))], Averaging())
    fits = [identify(each, REQUEST).found.fit for each in (of_records([one], Averaging()), source)]
    assert fits[0] is not None and fits[1] is not None
    assert fits[1].model.f_hz == pytest.approx(fits[0].model.f_hz, rel=1e-4)
    assert fits[1].model.zeta == pytest.approx(fits[0].model.zeta, rel=0.01)
    assert "lines with hardly any input do not count: still moving" in source.remarks[-1]
    driven = np.isfinite(source.responses.coherence["a", "hammer"])
    assert 0.3 < np.mean(driven) < 0.7


def test_a_window_over_hits_is_warned_of_and_its_fit_does_not_pass() -> None:
    source, result = identified(Averaging(window="hann"))
    assert any("behind a hann window a hit counts otherwise" in line for line in source.remarks)
    page = build_page([Path("hits.npz")], result)
    assert result.found.fit is None or not page.passed


def test_hits_that_still_ring_at_the_end_of_a_block_are_told() -> None:
    source, _ = identified(Averaging(resolution_hz=1.0))
    assert any("is left at the end of a block: a, b; dampings" in line for line in source.remarks)


def test_a_block_has_no_more_lines_than_the_chart_can_use() -> None:
    """A fifth of 60 s at 2 kHz made 9375 lines, over which no mode of 15 Hz was seen any more."""
    rng = np.random.default_rng(0)
    sizes = {}
    for samples in (4000, 30_000, 120_000):
        u, y = rng.standard_normal((2, samples))
        run = Records(2000.0, {"u": u}, {"y": y}, "accelerance")
        sizes[samples] = cut_of([run], Averaging()).settings.block
    assert sizes == {4000: 800, 30_000: 6000, 120_000: 7500}
    run = hit(0, 10.0)
    long = {name: np.append(y, np.zeros(60_000)) for name, y in run.outputs.items()}
    whole = replace(run, inputs={"hammer": np.append(run.inputs["hammer"], np.zeros(60_000))}, outputs=long)
    assert cut_of([run], Averaging()).settings.block == 2000
    cut = cut_of([whole], Averaging())
    assert cut.settings.block == cut.used == 25_600  # blocks without a hit would be drawn by the bootstrap


def test_a_fit_that_leaves_a_fifth_of_the_responses_is_no_pass() -> None:
    _, result = identified(Averaging())
    fit = result.found.fit
    assert fit is not None and build_page([Path("hits.npz")], result).passed
    poor = replace(fit, model=replace(fit.model, error=0.25))
    page = build_page([Path("hits.npz")], replace(result, found=replace(result.found, fit=poor)))
    assert not page.passed and "at most 20 %" in page.to_text()


def test_what_lasts_is_no_hit() -> None:
    t, rng = np.arange(4000) / RATE, np.random.default_rng(0)
    signals = (
        rng.standard_normal(t.size),
        np.sin(7 * t),
        signal.chirp(t, 1.0, 20.0, 50.0),
        np.sign(rng.standard_normal(t.size)),
        np.exp(-t),
    )
    for x in signals:
        assert not are_hits([SimpleNamespace(inputs={"u": x})])  # type: ignore[list-item]
    assert are_hits([replace(hit(0, 10.0), inputs={"one": hit(0, 10.0).inputs["hammer"], "still": 0 * t})])


def test_hits_of_one_hammer_at_a_time_are_known_beside_noise_of_the_others() -> None:
    """Noise of a two thousandth of the hit on the force that rested made a window of both runs."""
    x, rng = hit(0, 10.0).inputs["hammer"], np.random.default_rng(0)
    noise = 5e-4 * x.max() * rng.standard_normal((2, x.size))
    runs = [{"one": x + noise[0], "two": noise[1]}, {"one": noise[1], "two": x + noise[0]}]
    assert are_hits([replace(hit(0, 10.0), inputs=inputs) for inputs in runs])
    shaken = {"one": x, "two": x.max() * rng.standard_normal(x.size)}
    assert not are_hits([replace(hit(0, 10.0), inputs=inputs) for inputs in (*runs, shaken)])
