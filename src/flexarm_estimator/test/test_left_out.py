"""What a served model leaves out of the motion: machine code says what NumPy says, for all kinds of arms."""

from functools import cache

import numpy as np
import pytest
from arms import arm
from machines import machine

from flexarm_estimator.filters.choice import FilterMaker
from flexarm_estimator.filters.machine_left_out import MachineLeftOut
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import build_sensor_models
from flexarm_estimator.tool.tip import PlainTip
from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
ARMS = ["planar", "five_bar", "single_link", "variable_stiffness", "planar_3rrr"]
LONG = [pytest.param(name, marks=pytest.mark.slow) for name in ("spatial_3tpt", "serial_6r")]
DT = 0.002


@cache
def both_ways(name):
    """Return what is left out of an arm's motion in machine code and with NumPy, its model and process."""
    small = name in ("planar", "five_bar")
    config = arm(name) if small else machine(name)
    arm_tree = ReducedTree(config)
    settings = EstimatorConfig(filter="corrected", stiffness_modes=2)
    model = linearize(arm_tree)
    biases = {f"{s.name}.{c}": s.bias for s in config.sensors if s.bias for c in s.channels}
    process = ProcessModel(model, settings, biases)
    models = build_sensor_models(config.sensors, model, process.system, PlainTip(model, arm_tree))
    made = FilterMaker(arm_tree, settings).make(model, process, models)
    assert isinstance(made._left_out, MachineLeftOut)
    return made._left_out, made._left_out._plain, model, process


def moving(model, process, seed, size=1.0):
    """Return a state in motion away from the served pose, and inputs."""
    rng = np.random.default_rng(seed)
    x = size * np.sqrt(process.P0.diagonal()) * rng.uniform(-1, 1, len(process.P0))
    n, n_theta = model.n, model.n_theta
    x[:n_theta] += model.xi0[:n_theta] + rng.uniform(-0.1, 0.1, n_theta)
    x[n_theta:n] += model.xi0[n_theta:]
    return x, np.append(
        model.f0[:n_theta] + 10.0 * np.diag(model.M)[:n_theta] * rng.normal(size=n_theta), 1.0
    )


@pytest.mark.parametrize("name", ARMS + LONG)
def test_machine_code_and_numpy_leave_out_the_same(name):
    """At several steps, far from rest; what was returned before does not change."""
    fast, plain, model, process = both_ways(name)
    pairs = []
    for seed, dt in enumerate((1e-6, DT, DT, 2e-4)):
        x, u = moving(model, process, seed, 0.03)
        step = process.step(dt)
        pairs.append((fast.at(x, step, u), plain.at(x, step, u)))
    n = model.n
    for left_out, wanted in pairs:
        assert abs(wanted[:n]).max() > 0.0
        np.testing.assert_array_equal(left_out[-model.n_theta - 1 :], wanted[-model.n_theta - 1 :])
        for part in (slice(0, n), slice(n, None)):
            scale = max(abs(wanted[part]).max(), 1.0)
            np.testing.assert_allclose(left_out[part], wanted[part], rtol=0, atol=1e-8 * scale)


@pytest.mark.parametrize("name", ["single_link", "planar_3rrr"])
@pytest.mark.filterwarnings("ignore:invalid value")  # of NumPy
@pytest.mark.parametrize("wild", ["nan", "inf", "one_nan", "torque", "astray", "open"])
def test_both_leave_out_nothing_where_the_mean_cannot_be_right(name, wild):
    fast, plain, model, process = both_ways(name)
    x, u = moving(model, process, 5)
    if wild == "torque":
        u[0] = np.nan
    elif wild == "one_nan":
        x[-1] = np.nan
    elif wild == "astray":
        x[model.n_theta] += 1e3
    elif wild == "open":
        x[: model.n_theta] += 40.0 * np.arange(1, model.n_theta + 1)  # loops do not close there
    else:
        x[:] = float(wild)
    left_out = fast.at(x, process.step(DT), u)
    wanted = plain.at(x, process.step(DT), u)
    if wild != "open":
        np.testing.assert_array_equal(wanted[: -u.size], 0.0)
        np.testing.assert_array_equal(left_out, wanted)
    else:
        np.testing.assert_allclose(left_out, wanted, atol=1e-6 * max(abs(wanted).max(), 1.0))
    assert np.isfinite(left_out[: -u.size]).all()


def test_steps_of_ever_new_lengths_do_not_pile_up():
    """A camera by a clock of its own cuts every period at another place."""
    fast, _, model, process = both_ways("single_link")
    x, u = moving(model, process, 6, 0.03)
    for i in range(600):
        fast.at(x, process.step(1e-3 + 1e-6 * i), u)
    assert len(fast._steps) <= 128
