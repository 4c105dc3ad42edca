"""A simulated arm whose pressure changes on the way moves as one that was built under that pressure."""

from dataclasses import replace

import numpy as np
import pytest

from flexarm_bringup.sim.implicit_period import MachinePeriod, PlainPeriod, Stepping, make_period
from flexarm_bringup.sim.implicit_steps import ImplicitSteps
from flexarm_bringup.sim.plant import Plant
from flexarm_model.manipulator.other_parameters import ParameterRangeError
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

PATH, DT = find_manipulator("variable_stiffness"), 0.005
SOFT = {"pressure": 1.25e5}


LEANING = np.array([0.3, 0.6, 0.5])  # rad; at home it stands upright, and its weight bends nothing


def plant_at(home=None, **changes):
    config = load_config(PATH, changes={f"parameters.{name}": value for name, value in changes.items()})
    return Plant(config if home is None else replace(config, home=home), DT)


@pytest.fixture(scope="module")
def plants():
    """Return a plant built at 2 bar, and one built at 1.25 bar."""
    return plant_at(), plant_at(pressure="1.25 bar")


def moved(plant, start, servo):
    plant.q, plant.v = (part.copy() for part in start)
    for k in range(60):
        push = np.array([0.5, -0.3, 0.2]) * np.sin(0.2 * k)
        (plant.servo if servo else plant.drive)(push)
    return np.concatenate([plant.q, plant.v, plant.a])


@pytest.mark.parametrize("servo", [False, True])
def test_led_to_a_pressure_it_moves_as_if_built_so_and_back_as_before(plants, servo):
    led, built = plants
    start = led.q.copy(), 0.2 * np.ones(led.tree.n_q)
    stiff = moved(led, start, servo)
    led.lead(SOFT)
    soft = moved(led, start, servo)
    np.testing.assert_allclose(soft, moved(built, start, servo), rtol=1e-6, atol=1e-7)
    assert abs(soft - stiff).max() > 1e-2
    led.lead({})
    np.testing.assert_allclose(moved(led, start, servo), stiff, rtol=0.0, atol=0.0)


def test_it_comes_to_rest_deeper_when_reset_under_less_pressure():
    led, built = plant_at(LEANING), plant_at(LEANING, pressure="1.25 bar")
    stiff, bends = led.q.copy(), np.setdiff1d(np.arange(led.tree.n_q), led.tree.actuated)
    led.lead(SOFT)
    led.reset()
    np.testing.assert_allclose(led.q, built.q, atol=1e-9)
    np.testing.assert_array_equal(led.theta, LEANING)
    assert np.linalg.norm(led.q[bends]) > 1.2 * np.linalg.norm(stiff[bends]) > 0.005
    led.lead({})
    led.reset()
    np.testing.assert_array_equal(led.q, stiff)
    with pytest.raises(ParameterRangeError, match="is not within"):
        led.lead({"pressure": 0.5e5})


@pytest.mark.parametrize("is_driven", [True, False])
def test_implicit_steps_follow_a_parameter_too(is_driven):
    tree = ReducedTree(load_config(PATH))
    soft, stepping = tree.under(SOFT), Stepping(1e-3, 5, 0.0, is_driven)
    period, plain = make_period(tree, stepping), PlainPeriod(soft, stepping)
    assert isinstance(period, MachinePeriod)
    q, v, u = 0.1 * np.ones(tree.n_q), np.zeros(tree.n_q), np.array([0.3, -0.2, 0.1])
    before = np.concatenate(period.advance(q, v, u))
    period.follow(soft)
    wanted = np.concatenate(plain.advance(q, v, u))
    np.testing.assert_array_equal(np.concatenate(period.advance(q, v, u)), wanted)
    period.follow(tree)
    np.testing.assert_array_equal(np.concatenate(period.advance(q, v, u)), before)
    steps = ImplicitSteps(tree, 5e-3, 5, 0.0)
    steps.follow(soft)
    move = steps.drive if is_driven else steps.servo
    np.testing.assert_allclose(np.concatenate(move(q, v, u)), wanted)
