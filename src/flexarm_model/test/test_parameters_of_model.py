"""The pressure that a served model was made for is found from its frequencies."""

import pytest

from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.parameters_of_model import parameters_of
from flexarm_model.tree.reduced_tree import ReducedTree


@pytest.fixture(scope="module")
def arm() -> ReducedTree:
    return ReducedTree(load_config(find_manipulator("variable_stiffness")), use_compiler=False)


@pytest.mark.parametrize("pressure", [1.0e5, 1.2e5, 1.999e5])
def test_the_pressure_of_a_model_is_found_and_gives_the_model_again(
    arm: ReducedTree, pressure: float
) -> None:
    model = linearize(arm.under({"pressure": pressure}), [0.3, 1.0, -0.5])
    values = parameters_of(arm, model.pose, model.omega, arm.config.parameters)
    assert values["pressure"] == pytest.approx(pressure, rel=1e-7)
    again = linearize(arm.under(values), model.pose)
    assert pytest.approx(model.M, rel=1e-8, abs=1e-12) == again.M
    assert again.q0 == pytest.approx(model.q0, rel=1e-8, abs=1e-9)


def test_a_guess_that_will_do_is_kept_to_the_bit(arm: ReducedTree) -> None:
    for values in (arm.config.parameters, {"pressure": 1.3e5}):
        model = linearize(arm.under(values))
        assert parameters_of(arm, model.pose, model.omega, values) == values


def test_an_arm_without_parameters_has_none() -> None:
    link = ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False)
    model = linearize(link)
    assert parameters_of(link, model.pose, model.omega, {}) == {}
