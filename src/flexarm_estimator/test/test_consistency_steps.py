"""Steps of a consistency run in machine code: the same as with NumPy to rounding, and as honest."""

import numpy as np
import pytest
from planar_strip import SENSORS, StripKinematics, simulate, strip_model

from flexarm_estimator.gate import Gate
from flexarm_estimator.isolation import consistency_run
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_run import ConsistencyRun
from flexarm_estimator.isolation.hypotheses import rearrangements, undo
from flexarm_estimator.isolation.window import StepMaker, Window
from flexarm_estimator.parts import PartsMaker
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.compiled import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
CONFIG, COUNT = EstimatorConfig(), 40
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


def run_both(monkeypatch, window, channels, ignored):
    """Return a run in machine code and one with NumPy."""
    hypotheses, offsets = rearrangements(channels, range(3)), np.outer([1e-4, 1e-5, 0.1], [5.0, 1.0])
    runs = []
    for way in (consistency_run.bind_steps, lambda *_: None):
        monkeypatch.setattr(consistency_run, "bind_steps", way)
        runs.append(
            ConsistencyRun(window, undo(hypotheses, window.y), StepMaker(1e-5), ignored.copy(), offsets)
        )
        runs[-1].advance(COUNT)
    assert [run.is_sound for run in runs] == [runs[0].is_sound] * 2
    return runs


def test_machine_code_and_numpy_explain_a_window_alike(monkeypatch):
    """Rows left out here and there, all data of all hypotheses and offsets, a model that changes."""
    window, channels = make_window()
    ignored = np.random.default_rng(3).random(window.y.shape) < 0.1
    fast, plain = run_both(monkeypatch, window, channels, ignored)
    assert fast.is_sound
    for name in ("misfit", "log_det", "marginal", "predicted", "variance"):
        wanted = getattr(plain, name)
        np.testing.assert_allclose(getattr(fast, name), wanted, rtol=1e-6, atol=1e-9 * abs(wanted).max())
    for channel in range(3):
        np.testing.assert_allclose(fast.excused(channel), plain.excused(channel), rtol=1e-6)


def test_a_covariance_that_rounding_has_spoilt_ends_the_run_in_both(monkeypatch):
    window, channels = make_window()
    window.parts[0].process.P0 = -window.parts[0].process.P0
    fast, plain = run_both(monkeypatch, window, channels, np.zeros(window.y.shape, dtype=bool))
    assert not fast.is_sound
    assert not plain.is_sound
