"""Steps of a consistency run in machine code: the same as with NumPy to rounding, and as honest."""

import numpy as np
import pytest
from planar_strip import SENSORS, StripKinematics, simulate, strip_model

from flexarm_estimator.isolation import consistency_run
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_run import NO_OFFSETS, ConsistencyRun
from flexarm_estimator.isolation.hypotheses import rearrangements
from flexarm_estimator.isolation.isolation import leave_out_useless
from flexarm_estimator.isolation.window import StepMaker, Window
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.parts import PartsMaker
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.numeric.compiled import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
CONFIG, COUNT = EstimatorConfig(), 40
OFFSETS = np.outer([1e-4, 1e-5, 0.1], [5.0, 1.0])
RECORD = simulate(100, np.random.default_rng(21), camera_every=7)


def make_window():
    """Return a window in the middle of which another model is served."""
    gate = Gate({spec.name: spec.sigma.tolist() for spec in SENSORS}, CONFIG)
    maker = PartsMaker(StripKinematics(), SENSORS, CONFIG, gate)
    before, after = maker.make(strip_model()), maker.make(strip_model(hub_inertia=0.25))
    y = np.array([np.concatenate([s.y for s in RECORD.samples[k][:3]]) for k in range(50, 50 + COUNT)])
    u = np.column_stack([RECORD.tau[50 : 50 + COUNT], np.ones(COUNT)])
    parts = [before] * (COUNT // 2) + [after] * (COUNT // 2)
    return Window(RECORD.t[50 : 50 + COUNT], u, y, parts, np.zeros(1)), Channels(SENSORS, before.sensors.rows)


def run_both(monkeypatch, window, channels, ignored, offsets=OFFSETS):
    """Return a run in machine code and one with NumPy."""
    hypotheses = rearrangements(channels, frozenset(range(3)))
    runs = []
    for way in (consistency_run.bind_steps, lambda *_: None):
        monkeypatch.setattr(consistency_run, "bind_steps", way)
        runs.append(ConsistencyRun(window, hypotheses, StepMaker(1e-5), ignored.copy(), offsets))
        runs[-1].advance(COUNT)
    assert [run.is_sound for run in runs] == [runs[0].is_sound] * 2
    return runs


def test_machine_code_and_numpy_explain_a_window_alike(monkeypatch):
    """Rows left out here and there, all data of all hypotheses and offsets, a model that changes."""
    window, channels = make_window()
    ignored = np.random.default_rng(3).random(window.y.shape) < 0.1
    fast, plain = run_both(monkeypatch, window, channels, ignored)
    assert fast.is_sound
    for name in ("misfit", "log_det", "marginal", "extremes", "predicted", "variance"):
        wanted = np.array(getattr(plain, name))
        np.testing.assert_allclose(getattr(fast, name), wanted, rtol=1e-6, atol=1e-9 * abs(wanted).max())
    for channel in range(3):
        np.testing.assert_allclose(fast.excused(channel), plain.excused(channel), rtol=1e-6)


def test_a_covariance_that_rounding_has_spoilt_ends_the_run_in_both(monkeypatch):
    window, channels = make_window()
    window.parts[0].process.P0 = -window.parts[0].process.P0
    fast, plain = run_both(monkeypatch, window, channels, np.zeros(window.y.shape, dtype=bool))
    assert not fast.is_sound
    assert not plain.is_sound


def test_what_was_not_said_is_ignored_and_offsets_change_nothing_of_the_hypotheses(monkeypatch):
    window, channels = make_window()
    window.y[np.random.default_rng(4).random(window.y.shape) < 0.1] = np.nan
    ignored = np.isnan(window.y)
    with_offsets, _ = run_both(monkeypatch, window, channels, ignored)
    for run in run_both(monkeypatch, window, channels, ignored, NO_OFFSETS):
        np.testing.assert_allclose(run.misfit, with_offsets.misfit, rtol=1e-6)
        np.testing.assert_allclose(run.extremes, with_offsets.extremes, rtol=1e-6)


def test_steps_in_one_call_are_as_one_by_one():
    window, channels = make_window()
    hypotheses, ignored = rearrangements(channels, frozenset(range(3))), np.zeros(window.y.shape, dtype=bool)
    at_once, singly = (ConsistencyRun(window, hypotheses, StepMaker(1e-5), ignored) for _ in range(2))
    at_once.advance(COUNT)
    while not singly.is_done:
        singly.advance(1)
    np.testing.assert_array_equal(at_once.misfit, singly.misfit)
    np.testing.assert_array_equal(at_once.predicted, singly.predicted)


def test_what_is_useless_is_left_out_alike_in_machine_code_and_with_numpy():
    """A channel that repeats itself just too often, one that does not, one silent here and there."""
    y = np.random.default_rng(5).normal(size=(60, 3))
    for channel, repeated in ((0, 31), (1, 30)):
        y[1 : 1 + repeated, channel] = y[0, channel]
    y[[3, 17], 2] = np.nan
    fast, plain = np.zeros((2, 60, 3), dtype=bool)
    fast[5, 1] = plain[5, 1] = True
    assert leave_out_useless(y, fast) == [1, 2]
    assert leave_out_useless(y, plain, use_compiler=False) == [1, 2]
    np.testing.assert_array_equal(fast, plain)
    assert fast[:, 0].all()
    assert np.flatnonzero(fast[:, 1]).tolist() == [5]
    assert np.flatnonzero(fast[:, 2]).tolist() == [3, 17]
