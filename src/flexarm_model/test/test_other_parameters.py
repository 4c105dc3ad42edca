"""An arm under other values of its parameters: the same as one that was described so from the start."""

from dataclasses import replace

import numpy as np
import pytest
import yaml

from flexarm_model.manipulator.other_parameters import ParameterRangeError, parameter_range, under
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

PATH = find_manipulator("variable_stiffness")
POSE = np.radians([-20.0, 40.0, -30.0])


@pytest.fixture(scope="module")
def trees():
    """Return the tree at 2 bar led to 1.3 bar, and one that was built at 1.3 bar."""
    led = ReducedTree(load_config(PATH), use_compiler=False).under({"pressure": 1.3e5})
    built = ReducedTree(load_config(PATH, changes={"parameters.pressure": "1.3 bar"}), use_compiler=False)
    return led, built


def test_a_served_model_is_that_of_an_arm_described_so(trees):
    led, built = (linearize(tree, POSE) for tree in trees)
    for name in ("M", "D", "K", "f0", "omega", "zeta", "q0"):
        np.testing.assert_allclose(getattr(led, name), getattr(built, name), rtol=1e-9, atol=1e-9)
    assert led.config_id == linearize(ReducedTree(load_config(PATH), use_compiler=False)).config_id
    assert led.omega[0] < 0.9 * linearize(ReducedTree(load_config(PATH), use_compiler=False), POSE).omega[0]


@pytest.mark.parametrize(
    "name", ["inverse_dynamics", "bias", "motion", "stiffness", "forward_dynamics", "mass_matrix"]
)
def test_every_function_is_that_of_an_arm_described_so(trees, name):
    led, built = trees
    rng = np.random.default_rng(3)
    arguments = 0.3 * rng.standard_normal((led.expressions[name].n_in(), led.n_q))
    found = [tree.functions[name](*arguments) for tree in trees]
    by_expression = [tree.expressions[name](*arguments) for tree in trees]
    for parts in (found, by_expression):
        for one, other in zip(*(part if isinstance(part, tuple) else (part,) for part in parts), strict=True):
            np.testing.assert_allclose(np.array(one), np.array(other), rtol=1e-9, atol=1e-9)
    assert set(led.functions) == set(built.functions) and len(led.functions) == len(built.functions)


def test_led_there_and_back_the_arm_is_as_it_was():
    tree = ReducedTree(load_config(PATH), use_compiler=False)
    back = tree.under({"pressure": 1.0e5}).under({"pressure": 2.0e5})
    np.testing.assert_allclose(back.K, tree.K, rtol=1e-12)
    q = np.full(tree.n_q, 0.1)
    np.testing.assert_allclose(back.linearisation(q)[3], tree.linearisation(q)[3], rtol=1e-9, atol=1e-12)
    assert tree.under({"pressure": 2.0e5}) is tree and tree.under({}) is tree


def test_what_scales_the_springs_goes_on_to_scale_them():
    config = load_config(PATH)
    softer_axes = [
        tuple(replace(axis, stiffness=0.7 * axis.stiffness) for axis in j.axes) for j in config.joints
    ]
    joints = (replace(j, axes=axes) for j, axes in zip(config.joints, softer_axes, strict=True))
    softer = replace(config, joints=tuple(joints))
    led = under(softer, {"pressure": 1.5e5}).axes["elbow_spring.rz"].stiffness
    assert led == pytest.approx(0.7 * under(config, {"pressure": 1.5e5}).axes["elbow_spring.rz"].stiffness)


@pytest.mark.parametrize("value", [0.99e5, 2.01e5, float("nan")])
def test_a_value_that_no_law_reaches_is_refused_with_what_is_known(value):
    config = load_config(PATH)
    assert parameter_range(config, "pressure") == (1e5, 2e5)
    with pytest.raises(ParameterRangeError, match=r"pressure = .* is not within 100000 ... 200000"):
        under(config, {"pressure": value})
    with pytest.raises(ParameterRangeError, match=r"no parameter 'heat'; it has pressure"):
        under(config, {"heat": 1.0})
    with pytest.raises(ParameterRangeError, match=r"has no parameter 'pressure'; it has none"):
        under(load_config(find_manipulator("single_link")), {"pressure": 1.0})


def test_play_where_a_coefficient_follows_a_parameter_is_refused(tmp_path):
    content = yaml.safe_load(PATH.read_text())
    content["joints"]["elbow_spring"]["axes"]["rz"]["backlash"] = "1 mrad"
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(
        ConfigError, match=r"elbow_spring.axes.rz.backlash: '1 mrad': not where a coefficient follows"
    ):
        load_config(path)
