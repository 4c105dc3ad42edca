"""Numbers with an exponent and no point are numbers, as ROS reads them; 010 is none to be guessed at."""

from __future__ import annotations

from typing import Any

import pytest

from flexarm_model.settings.yaml_file import ConfigError, parse_yaml


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


@pytest.mark.parametrize("written", ["010", "-010", "+08", "00", "0_7", "[1, [010]]"])
def test_a_number_that_begins_with_a_zero_is_octal_to_some_and_refused(written: str) -> None:
    with pytest.raises(ConfigError, match=r"a\.yaml: line 2: '.*' begins with a zero"):
        parse_yaml(f"first: 1\nkey: {written}", "a.yaml")


@pytest.mark.parametrize(
    ("written", "read"),
    [("0", 0), ("-0", 0), ("0.10", 0.1), ("00.5", 0.5), ("'010'", "010"), ("010 mm", "010 mm"), ("0x10", 16)],
)
def test_a_zero_before_a_point_or_in_a_text_is_no_matter(written: str, read: Any) -> None:
    assert parse_yaml(f"key: {written}", "a.yaml")["key"] == read
