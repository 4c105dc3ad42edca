"""Limits are checked when they are made."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import limits_of_hub

from flexarm_controller.limits import limits_of
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.parameters import ParameterError


@pytest.mark.parametrize(
    "change",
    [
        {"effort": np.array([0.0])},
        {"effort": np.array([np.inf])},
        {"effort_rate": np.array([1.0, 1.0])},
        {"velocity": np.array([np.nan])},
        {"position_low": np.array([4.0])},
        {"strain": np.array([])},
    ],
)
def test_what_is_no_limit_is_refused_by_name(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        replace(limits_of_hub(), **change)


def test_limits_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        limits_of_hub().effort[0] = 1e9


def test_an_array_of_the_caller_stays_his_and_the_limits_keep_their_own():
    effort = np.array([2.0])
    limits = replace(limits_of_hub(), effort=effort)
    effort[0] = 1e9
    assert limits.effort[0] == 2.0


def test_limits_come_from_the_description():
    limits = limits_of(load_config(find_manipulator("single_link"), "light_hub"))
    assert (limits.effort[0], limits.effort_rate[0], limits.velocity[0]) == (2.0, 200.0, 6.0)
    np.testing.assert_allclose([limits.position_low[0], limits.position_high[0]], np.deg2rad([-170, 170]))
    assert limits.gauges == ("root_strain.strain",) and limits.strain[0] == pytest.approx(1e-3)


def test_an_axis_without_effort_is_named_and_nothing_else_is_blamed():
    config = load_config(find_manipulator("single_link"), "light_hub")
    joint, *others = config.joints
    bare = replace(joint.axes[0], effort=np.inf, lower=-np.inf, upper=np.inf, velocity=np.inf)
    with pytest.raises(ValueError, match=r"joints\.base\.axes\.rz\.effort: is missing; .*'effort: 20 N m'$"):
        limits_of(replace(config, joints=(replace(joint, axes=(bare,)), *others)))
    with pytest.raises(ValueError, match=r"^limits\.effort: \[inf\] must be finite$"):
        replace(limits_of_hub(), effort=np.array([np.inf]))
    with pytest.raises(ValueError, match=r"^limits\.position_low: \[4\.\]"):
        replace(limits_of_hub(), position_low=np.array([4.0]))


def test_settings_that_do_not_fit_together_are_refused():
    with pytest.raises(ParameterError, match="blocks: they sum to 3, not to horizon 40"):
        MpcConfig(blocks=(1, 2))
    with pytest.raises(ParameterError, match="foresight: true: expected false where stiffness_step"):
        MpcConfig(foresight=True, stiffness_step=0.1)
    with pytest.raises(ParameterError, match="backend: 'gurobi' is not one of daqp, osqp, hpipm"):
        MpcConfig(backend="gurobi")
    with pytest.raises(ParameterError, match="position_error"):
        MpcConfig(position_error=float("nan"))
    with pytest.raises(ParameterError, match="law"):
        ControllerConfig(law="pid")
