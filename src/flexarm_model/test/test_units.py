"""Quantities: what is written is what is meant."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexarm_model.settings.units import UNITS, axis_dimension, is_sliding, parse_quantity, si_unit

NUMBERS = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e12, max_value=1e12)
DIMENSION_AND_UNIT = st.sampled_from([(dimension, unit) for dimension in UNITS for unit in UNITS[dimension]])

# What the unit is worth in SI, by the BIPM's brochure and not by the table under test.
WORTH = [
    ("length", "3.2 mm", 0.0032), ("length", "7 um", 7e-6), ("area", "64 mm^2", 64e-6),
    ("second moment of area", "54.6 mm^4", 54.6e-12), ("mass", "54 g", 0.054), ("inertia", "2 kg mm^2", 2e-6),
    ("density", "7750 kg/m^3", 7750.0), ("pressure", "208.5 GPa", 208.5e9), ("pressure", "1 MPa", 1e6),
    ("angle", "180 deg", math.pi), ("angle", "20 urad", 2e-5), ("angle", "5 mrad", 5e-3),
    ("time", "60 ms", 0.06),
    ("frequency", "1 kHz", 1e3), ("acceleration", "1 g", 9.80665), ("strain", "1000 ustrain", 1e-3),
    ("ratio", "2 %", 0.02), ("ratio", "0.015", 0.015), ("velocity", "2 mm/s", 2e-3),
    ("angular velocity", "90 deg/s", math.pi / 2), ("force", "3 kN", 3e3), ("torque", "5 mN m", 5e-3),
    ("force rate", "1 kN/s", 1e3), ("torque rate", "2 kN m/s", 2e3), ("stiffness", "4 N/mm", 4e3),
    ("rotational stiffness", "5 N m/rad", 5.0), ("damping", "3 N s/m", 3.0),
    ("rotational damping", "0.2 N m s/rad", 0.2), ("damping rate", "0.3 1/s", 0.3),
    ("length drift", "2 um/sqrt(s)", 2e-6),
    ("angle drift", "3 urad/sqrt(s)", 3e-6), ("strain drift", "0.5 ustrain/sqrt(s)", 5e-7),
    ("acceleration drift", "1 g/sqrt(s)", 9.80665), ("length rate", "2 um/s", 2e-6),
    ("angle rate", "3 urad/s", 3e-6), ("strain rate", "0.3 ustrain/s", 3e-7),
    ("acceleration rate", "1 m/s^2/s", 1.0), ("angular velocity drift", "2 mrad/s/sqrt(s)", 2e-3),
    ("angular velocity rate", "180 deg/s/s", math.pi),
]  # fmt: skip


@pytest.mark.parametrize(("dimension", "text", "value"), WORTH)
def test_a_quantity_is_read_in_si(dimension: str, text: str, value: float) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-15)


def test_every_dimension_is_checked_against_the_si_brochure() -> None:
    assert {dimension for dimension, _, _ in WORTH} == set(UNITS)


@given(NUMBERS, DIMENSION_AND_UNIT)
def test_what_is_written_comes_back(number: float, pair: tuple[str, str]) -> None:
    dimension, unit = pair
    back = parse_quantity(f"{number!r} {unit}", dimension) / UNITS[dimension][unit]
    assert back == pytest.approx(number, rel=1e-15, abs=1e-300)


@given(NUMBERS, DIMENSION_AND_UNIT, st.sampled_from(sorted(UNITS)))
def test_a_unit_of_another_dimension_is_refused(number: float, pair: tuple[str, str], other: str) -> None:
    _, unit = pair
    if unit not in UNITS[other]:
        with pytest.raises(ValueError, match="expected a number with one of the units"):
            parse_quantity(f"{number!r} {unit}", other)


@pytest.mark.parametrize("text", ["nan m", "inf m", "-inf m", "1e400 m"])
def test_what_is_not_finite_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="must be finite"):
        parse_quantity(text, "length")


def test_a_number_that_its_unit_makes_infinite_is_refused() -> None:
    with pytest.raises(ValueError, match="must be finite"):
        parse_quantity("1e305 GPa", "pressure")


@pytest.mark.parametrize("value", [5, 5.0, "5", "five m", "m", "", None, True, [1], {"m": 1}])
def test_what_is_not_a_number_with_a_unit_is_refused(value: object) -> None:
    with pytest.raises(ValueError, match="expected a number with one of the units: m, mm, um"):
        parse_quantity(value, "length")


def test_a_ratio_may_be_a_bare_number() -> None:
    assert parse_quantity(0.5, "ratio") == 0.5


@pytest.mark.parametrize(
    "quantity", ["position", "velocity", "effort", "effort rate", "inertia", "stiffness", "damping"]
)
def test_an_axis_along_and_an_axis_about_share_no_unit(quantity: str) -> None:
    along, about = (UNITS[axis_dimension(axis, quantity)] for axis in ("tx", "rz"))
    assert not set(along) & set(about)


@pytest.mark.parametrize(
    ("axis", "slides"), [("tx", True), ("leg_t.tz", True), ("rz", False), ("tool.ry", False)]
)
def test_an_axis_slides_or_turns_whatever_its_joint_is_called(axis: str, slides: bool) -> None:
    assert is_sliding(axis) is slides
    assert axis_dimension(axis, "position") == ("length" if slides else "angle")


def test_values_are_kept_in_the_unit_of_worth_one() -> None:
    assert all(UNITS[dimension][si_unit(dimension)] == 1.0 for dimension in UNITS)


@pytest.mark.parametrize("text", ["5_00 mm", "1_0.5 mm", "1e1_0 mm"])
def test_an_underscore_is_no_part_of_a_number(text: str) -> None:
    with pytest.raises(ValueError, match="is not a number"):
        parse_quantity(text, "length")
