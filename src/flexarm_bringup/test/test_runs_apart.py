"""Runs of one set-up are averaged as long as each of them alone shows the same arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from flexarm_bringup import cli
from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.measurement import Records, SourceError
from flexarm_bringup.identify.run import Request
from flexarm_bringup.identify.runs_apart import Apart, compare_runs, run_tables
from flexarm_bringup.identify.sources import of_records

RATE, F_HZ, ZETA = 200.0, np.array([12.0, 29.0]), 0.02
BANDWIDTH = 2 * ZETA  # of a frequency
USUAL = Averaging()
REQUEST = Request((5.0, 45.0), 0.6)


def hit(seed: int, scale: float, seconds: float = 3.0, size: float = 1.0) -> Records:
    """Return a hit on an arm of scaled frequencies, what two sensors say to it, and 0.1 % of noise."""
    rng = np.random.default_rng(seed)
    x = np.zeros(round(seconds * RATE))
    x[20:23] = size * np.array([0.3, 1.0, 0.5])
    y = np.zeros((x.size, 2))
    for k, omega in enumerate(2 * np.pi * scale * F_HZ):
        plant = ([1.0, 0.0, 0.0], [1.0, 2 * ZETA * omega, omega**2])
        b, a, _ = signal.cont2discrete(plant, 1 / RATE, method="bilinear")
        y += np.outer(signal.lfilter(b.ravel(), a, x), [1.0, 0.7 - k])
    y += 0.001 * abs(y).max() * rng.standard_normal(y.shape)
    return Records(RATE, {"hammer": x}, {"a": y[:, 0], "b": y[:, 1]}, "accelerance", file=f"day_{seed}.npz")


def compared(runs: Sequence[Records], averaging: Averaging = USUAL) -> tuple[Apart, ...]:
    return compare_runs(of_records(runs, averaging), REQUEST, averaging)


def test_equal_arms_pass_without_a_word_whatever_the_level() -> None:
    assert compared([hit(1, 1.0), hit(2, 1.0, size=3.0)]) == ()
    assert run_tables(()) == []


def test_an_arm_that_moved_by_a_part_of_a_bandwidth_is_told_run_by_run() -> None:
    """They were averaged, and nothing was said."""
    told = compared([hit(1, 1.0), hit(2, 1.0 - 0.3 * BANDWIDTH)])
    assert [mode.bandwidths for mode in told] == pytest.approx([0.3, 0.3], abs=0.03)  # of warped frequencies
    (table,) = run_tables(told)
    assert [row[2] for row in table.rows] == 2 * ["run 1 (day_1.npz)", "run 2 (day_2.npz)"]


def test_an_arm_that_moved_by_most_of_a_bandwidth_is_refused_with_the_frequencies_of_every_run() -> None:
    """Their mean had a mode more than either and too much damping, and passed all checks."""
    said = (
        r"Hz in run 1 \(day_1.npz\), .* in run 2 .* 0\.\d\d of a half-power bandwidth apart.* one at a time"
    )
    with pytest.raises(SourceError, match=said):
        compared([hit(1, 1.0), hit(2, 1.0 - 0.9 * BANDWIDTH)])


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "count"), [(1.0, 0), (1.0 - 0.3 * BANDWIDTH, 2)])
def test_runs_that_part_the_inputs_only_together_are_compared_together(scale: float, count: int) -> None:
    runs = []
    for seed, arm in enumerate([1.0, 1.0, scale, scale]):
        run = hit(seed, arm)
        other = {"drop": 0.0 * run.inputs["hammer"]}
        runs.append(replace(run, inputs={**run.inputs, **other}))
        if seed % 2:
            other = {"drop": run.inputs["hammer"], "hammer": other["drop"]}
            outputs = {"a": run.outputs["b"], "b": run.outputs["a"]}
            runs[-1] = replace(run, inputs=other, outputs=outputs)
    told = compared(runs)
    assert len(told) == count
    assert all(mode.names[1] == "runs 3 to 4 (day_2.npz, day_3.npz)" for mode in told)


@pytest.mark.slow
@pytest.mark.parametrize("resolution", [None, 0.5])
def test_noise_that_is_a_runs_own_is_no_change_of_the_arm(resolution: float | None) -> None:
    """Sigma of the fit alone, which takes it for white, is too small for what a window leaves of it."""
    b, a, _ = signal.cont2discrete(([1.0], [1.0, 2 * ZETA * 75.0, 75.0**2]), 1 / RATE, method="zoh")
    for seed in range(3):
        rng, runs = np.random.default_rng(seed), []
        for _ in range(2):
            x = rng.standard_normal(4000)
            y = signal.lfilter(b.ravel(), a, x)
            y += 0.01 * y.std() * rng.standard_normal(y.size)
            runs.append(Records(RATE, {"torque": x}, {"a": y}, "receptance", is_held=True))
        assert compared(runs, Averaging(resolution)) == ()


@pytest.mark.slow
def test_sessions_of_the_rig_are_averaged_told_or_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four days on which the arm softened by 2.7 % gave three modes for two, and a wrong description."""
    arm = ["--manipulator", "single_link", "--preset", "geared"]
    sessions = {
        "new": [], "weak": ["--share", "0.1", "--perturb", "seed=5"], "chirp": ["--excite", "chirp"],
        "day_3": ["--perturb", "frequency_scale=0.991"], "day_9": ["--perturb", "frequency_scale=0.973"],
    }  # fmt: skip
    files = {name: str(tmp_path / f"{name}.npz") for name in sessions}
    for name, more in sessions.items():
        assert cli.main(["identify", "rig", *arm, *more, "--save", files[name]]) == 0
    capsys.readouterr()
    assert cli.main(["identify", *(files[name] for name in ("new", "weak", "chirp")), *arm]) == 0
    assert "Runs apart" not in capsys.readouterr().out
    assert cli.main(["identify", files["new"], files["day_3"], *arm]) == 0
    assert "run 2 (day_3.npz)" in capsys.readouterr().out
    update = tmp_path / "fitted.yaml"
    assert cli.main(["identify", files["new"], files["day_9"], *arm, "--update", str(update)]) == 2
    assert "run 2 (day_9.npz)" in capsys.readouterr().err and not update.exists()
