"""The search of weights: against functions whose minimum is known, and what it must not accept."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from flexarm_bringup.retune.bench import Bench, Outcome, Settings
from flexarm_bringup.retune.search import GAIN, SEEDS, STEP, WORSE, Score, Twins, search, twins_of
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.tip_vibration import Residual
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.settings import EstimatorConfig

START: Settings = (EstimatorConfig(), MpcConfig())
MANY = 100  # steps
BEST = {"position_error": 0.0092 * STEP**3, "input_jerk": 216.0 / STEP**2}


def bowl(settings: Settings, enough: float) -> Score:
    """A residual that grows with the distance from ``BEST``, in steps; nothing else matters to it."""
    steps = [math.log(getattr(settings[1], name) / value, STEP) for name, value in BEST.items()]
    return Score(math.exp(float(np.linalg.norm(steps))), 1.0, 1.0, False)


def everything(settings: Settings) -> bool:
    return True


def silent(text: str) -> None:
    pass


def test_the_search_ends_at_the_minimum_of_a_bowl_and_changes_nothing_else() -> None:
    found = search(START, bowl, everything, silent, MANY)
    assert found.steps[-1].residual == pytest.approx(1.0)
    changed = {k for k, v in vars(found.mpc).items() if v != getattr(START[1], k)}
    assert changed == set(BEST)
    assert all(getattr(found.mpc, name) == pytest.approx(value) for name, value in BEST.items())


def test_every_kept_step_lowers_the_residual_by_what_is_asked() -> None:
    found = search(START, bowl, everything, silent, MANY)
    left = [found.begin, *(step.residual for step in found.steps)]
    assert all(after <= GAIN * before for before, after in zip(left, left[1:], strict=False))


def test_a_step_that_loses_a_margin_is_not_kept() -> None:
    found = search(START, bowl, lambda settings: settings[1].position_error < 0.02, silent, MANY)
    assert found.mpc.position_error == pytest.approx(0.0092 * STEP)
    assert found.mpc.input_jerk == pytest.approx(BEST["input_jerk"])


@pytest.mark.parametrize("worse", ["tracking", "settling", "stopped"])
def test_less_vibration_does_not_pay_for_a_worse_move(worse: str) -> None:
    def score(settings: Settings, enough: float) -> Score:
        residual = bowl(settings, enough).residual
        bad = 1.0 if settings == START else WORSE + 0.01
        return Score(
            residual,
            bad if worse == "tracking" else 1.0,
            bad if worse == "settling" else 1.0,
            worse == "stopped" and settings != START,
        )

    assert search(START, score, everything, silent).mpc == START[1]


@pytest.mark.parametrize("settling", [-0.2, 0.0, 0.2, math.inf])
def test_who_settles_as_before_settles_no_worse_even_where_that_is_before_the_end(settling: float) -> None:
    start, after = Score(1.0, 1.0, settling, False), Score(0.5, 1.0, settling, False)
    assert after.is_better(start, start)
    assert math.isinf(settling) or not Score(0.5, 1.0, settling + 0.02, False).is_better(start, start)


def test_settings_without_a_law_are_passed_over() -> None:
    def score(settings: Settings, enough: float) -> Score:
        if settings[1].input_jerk < START[1].input_jerk:
            raise np.linalg.LinAlgError("no law")
        return bowl(settings, enough)

    found = search(START, score, everything, silent, MANY)
    assert found.mpc.input_jerk == START[1].input_jerk
    assert found.mpc.position_error == pytest.approx(BEST["position_error"])


@pytest.mark.parametrize("left", [(1.0, 1.0, 1.0, 1.0), (2.5, 0.1, 0.1, 0.1), (0.5, 1.7, 0.2, 0.4)])
@pytest.mark.parametrize("enough", [0.7, 0.95, 1.0, 1.5])
def test_runs_stop_early_only_where_all_of_them_would_leave_too_much(
    left: tuple[float, ...], enough: float
) -> None:
    """Every run of the twins is known: there is no score if and only if the RMS of all runs is too large."""
    outcomes = {
        seed: Outcome((Residual(a, a, 0.0, 1.0),), 0.0, "")
        for seed, a in zip([seed for seeds in SEEDS for seed in seeds], left, strict=True)
    }
    bench = cast(Bench, SimpleNamespace(run=lambda settings, seed: outcomes[seed]))
    found = Twins([bench] * len(SEEDS)).score(START, enough)
    assert (found is None) == (np.sqrt(np.mean(np.square(left))) > enough)
    assert found is None or found.residual == pytest.approx(np.sqrt(np.mean(np.square(left))))


def test_settings_under_which_the_arm_is_stopped_are_left_for_any_under_which_it_moves() -> None:
    """An arm that was stopped early is quiet: no step that moved it left less."""

    def score(settings: Settings, enough: float) -> Score | None:
        residual = 0.02 if settings == START else 0.1 * bowl(settings, enough).residual
        return Score(residual, 1.0, 1.0, settings == START) if residual <= enough else None

    found = search(START, score, everything, silent, MANY)
    assert found.mpc != START[1] and found.begin == 0.02
    assert found.steps[-1].residual == pytest.approx(0.1)


def test_the_twins_of_an_arm_that_is_hardly_known_are_arms_that_can_be(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("flexarm_bringup.retune.search.Bench", lambda known, task, real, rig: rig)
    for doubt, off in ((0.4, 0.5), (0.1, 0.3), (0.0, 0.005)):
        rigs = cast("list[RigSettings]", twins_of(None, None, doubt)._benches)  # type: ignore[arg-type]
        assert [rig.frequency_scale for rig in rigs] == pytest.approx([1.0 + off, 1.0 - off])
