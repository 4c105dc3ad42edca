"""A start is one position for every axis, within its range."""

import math

import pytest

from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError


def test_a_start_within_the_ranges_is_the_home():
    assert starting_at(load_config(find_manipulator("single_link")), [0.5]).home.tolist() == [0.5]


@pytest.mark.parametrize(
    ("start", "told"),
    [
        ([9.0], r"start: base.rz: 9 rad; allowed -2.96706 to 2.96706"),
        ([-3.0], "base.rz: -3 rad"),
        ([math.nan], "base.rz: nan rad"),
        ([0.1, 0.2], "2 values; expected one each for base.rz"),
    ],
)
def test_another_one_is_refused_by_axis_value_and_what_is_allowed(start, told):
    """It was a traceback, and exit code 1, which is taken for a crash."""
    with pytest.raises(ConfigError, match=told):
        starting_at(load_config(find_manipulator("single_link")), start)
