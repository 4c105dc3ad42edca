"""Settings refuse what is outside what their fields say."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import pytest

from flexarm_model.settings.parameters import ParameterError, parameter, validate


@dataclass(frozen=True)
class Settings:
    rate: float = parameter(200.0, "Control rate.", "Hz", minimum=1.0, maximum=1000.0)
    weights: tuple[float, ...] = parameter((1.0, 2.0), "Weights.", minimum=0.0)
    mode: str = parameter("mpc", "Mode.", choices=("mpc", "lqr"))
    name: str = parameter("arm", "Any text.")
    enabled: bool = parameter(True, "Whether it acts.")


def test_defaults_and_the_ends_of_a_range_are_valid() -> None:
    for settings in (Settings(), Settings(rate=1.0), Settings(rate=1000.0), Settings(weights=())):
        validate(settings)


@pytest.mark.parametrize(
    ("change", "fragments"),
    [
        ({"rate": math.nan}, ("rate", "nan", "finite", "[1.0, 1000.0]", "Hz")),
        ({"rate": math.inf}, ("rate", "inf")),
        ({"rate": 0.5}, ("rate", "0.5")),
        ({"rate": 1001.0}, ("rate", "1001.0")),
        ({"weights": (1.0, -0.1)}, ("weights", "-0.1")),
        ({"weights": (1.0, math.nan)}, ("weights", "nan")),
        ({"mode": "pid"}, ("mode", "'pid'", "mpc, lqr")),
    ],
)
def test_a_wrong_setting_is_refused_by_name(change: dict[str, Any], fragments: tuple[str, ...]) -> None:
    with pytest.raises(ParameterError) as caught:
        validate(Settings(**change))
    for fragment in fragments:
        assert fragment in str(caught.value)
