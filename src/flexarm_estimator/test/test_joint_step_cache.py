"""Joint steps are found again, whoever spoke first, and have their rows in one order."""

import numpy as np
from planar_strip import DT, SENSORS, StripKinematics, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.served import ServedSteps
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.steps.joint_step_cache import JointStepCache

PARTS = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig()).past[0]
START, U = Belief(np.zeros(PARTS.layout.n_x), PARTS.process.P0), np.array([0.0, 1.0])


def new_cache():
    return JointStepCache(ServedSteps(PARTS.process, PARTS.sensors), PARTS.sensors.rows)


def test_a_step_does_not_depend_on_who_spoke_first_nor_on_who_is_no_row():
    cache, names = new_cache(), list(PARTS.sensors.rows)
    assert len(names) > 2
    step = cache.step(START, DT, U, names)
    assert step.stack.names == tuple(names)
    assert cache.step(START, DT, U, names[::-1]) is step
    assert cache.step(START, DT, U, ["camera", *names]) is step
    assert cache.step(START, DT + 1e-12, U, names) is step  # the same to a nanosecond


def test_other_periods_and_other_sensors_are_other_steps():
    cache, names = new_cache(), list(PARTS.sensors.rows)
    steps = [
        cache.step(START, DT, U, names),
        cache.step(START, 2 * DT, U, names),
        cache.step(START, DT, U, names[1:]),
        cache.step(START, DT, U, ["camera"]),
    ]
    assert len(set(map(id, steps))) == 4
    assert steps[2].stack.names == tuple(names[1:])
    assert steps[3].stack is None
