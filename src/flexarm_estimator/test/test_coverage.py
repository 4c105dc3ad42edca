"""Which sensors together tell where all axes are; what bends under weight does not tell it."""

import numpy as np
import pytest

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.judging.coverage import Coverage
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

SHOULDER, ELBOW = np.array([[1.0, 0.0]]), np.array([[0.0, 1.0]])
NOTHING = np.zeros((1, 2))


def test_every_axis_has_to_be_told():
    some = Coverage({"shoulder": SHOULDER, "gauge": NOTHING, "elbow": ELBOW, "camera": np.eye(2)})
    shoulder, elbow, camera = (some.bits[name] for name in ("shoulder", "elbow", "camera"))
    assert "gauge" not in some.bits
    told = [0, shoulder, elbow, shoulder + elbow, camera, elbow + camera]
    assert [some.covers(sensors) for sensors in told] == [False, False, False, True, True, True]


def test_an_axis_that_nobody_tells_is_not_asked_for():
    some = Coverage({"shoulder": SHOULDER, "gauge": NOTHING})
    assert some.covers(some.bits["shoulder"]) and not some.covers(0)


def test_two_encoders_of_the_same_axis_are_one():
    some = Coverage({"motor": SHOULDER, "joint": 1.01 * SHOULDER, "elbow": ELBOW})
    assert not some.covers(some.bits["motor"] + some.bits["joint"])


def estimator_of(name):
    config = load_config(find_manipulator(name))
    tree = ReducedTree(config)
    return Estimator(linearize(tree), tree, config.sensors, EstimatorConfig()), config


@pytest.mark.parametrize("name", ["single_link", "serial_6r", "variable_stiffness"])
def test_gauges_and_inertial_sensors_tell_of_no_axis_whatever_the_weight(name):
    """A gauge of the 6R reads another sag at each pose; it was taken to tell where the axes are."""
    estimator, config = estimator_of(name)
    locating = {name for name, sensor in estimator._parts.sensors.all().items() if sensor.locates}
    assert locating == {spec.name for spec in config.sensors if spec.kind in ("encoder", "camera")}


def test_a_heavy_arm_without_encoders_and_camera_is_lost_in_time():
    """It took 0.9 s, until its tip was uncertain by 0.1 m: the gauges went on."""
    estimator, config = estimator_of("serial_6r")
    dt, outputs, lost = 1.0 / config.rate_hz, estimator.model.outputs, []
    rows = {spec.name: outputs.rows(spec.name) for spec in config.sensors if spec.kind != "camera"}
    for k in range(400):
        spoken = [name for name in rows if k < 200 or not name.startswith("encoder")]
        samples = [Measurement(name, k * dt, outputs.y0[rows[name]]) for name in spoken]
        estimate = estimator.step(samples, estimator.model.f0[: estimator.model.n_theta], k * dt)
        lost += [k * dt] if k >= 200 and estimate.status == "lost" else []
    assert lost[0] - 199 * dt < 0.25 and estimate.reason == "nothing locates the axes"
