"""Numbers with an exponent and no point are numbers, as ROS reads them."""

from __future__ import annotations

from typing import Any

import pytest

from flexarm_model.settings.yaml_file import parse_yaml


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("1e-3", 1e-3),
        ("-2E4", -2e4),
        ("+.5e1", 5.0),
        ("3.e+2", 300.0),
        ("1.0e-03", 1e-3),
        ("[1e-2, 2]", [0.01, 2]),
        ("'1e-3'", "1e-3"),
        ("1e-3 m", "1e-3 m"),
        ("e-3", "e-3"),
        ("1e", "1e"),
    ],
)
def test_what_has_an_exponent_is_a_number_without_a_point_too(written: str, read: Any) -> None:
    value = parse_yaml(f"key: {written}", "a.yaml")["key"]
    assert (value, type(value)) == (read, type(read))
