"""Settings take what is given in the right type and range, and nothing else."""

from dataclasses import dataclass
from typing import Any

import pytest

from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.settings.parameters import ParameterError, parameter


@dataclass(frozen=True)
class Settings:
    rate: float = parameter(200.0, "Rate", "Hz", 1.0, 1000.0)
    count: int = parameter(3, "Count", minimum=0)
    blocks: tuple[int, ...] = parameter((1, 2), "Blocks", minimum=1)
    weights: tuple[float, ...] = parameter((1.0,), "Weights")
    names: tuple[str, ...] = parameter((), "Names")
    law: str = parameter("mpc", "Law", choices=("mpc", "lqr"))
    is_on: bool = parameter(False, "On")


def test_what_is_not_given_keeps_its_default() -> None:
    assert apply_overrides(Settings, {"of_another_class": 1}) == Settings()


def test_integers_become_floats_and_lists_tuples() -> None:
    settings = apply_overrides(
        Settings, {"rate": 3, "weights": [1, 2.5], "blocks": [4], "names": ["a"], "x": 1}
    )
    assert settings == Settings(rate=3.0, weights=(1.0, 2.5), blocks=(4,), names=("a",))
    assert type(settings.rate) is float
    assert type(settings.weights[0]) is float


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("rate", "fast", "rate: 'fast' is not a number in [1.0, 1000.0] Hz"),
        ("rate", True, "rate: True is not a number"),
        ("rate", [1.0], "is not a number"),
        ("rate", float("nan"), "rate: nan is not a finite number"),
        ("count", 1.0, "count: 1.0 is not a whole number in [0, inf]"),
        ("count", True, "count: True is not a whole number"),
        ("is_on", 1, "is_on: 1 is not true or false"),
        ("blocks", 3, "blocks: 3 is not a list of whole numbers"),
        ("blocks", [1, 0], "blocks: 0 is not a finite number in"),
        ("names", "camera", "names: 'camera' is not a list of texts"),
        ("law", "pid", "law: 'pid' is not one of mpc, lqr"),
    ],
)
def test_a_wrong_value_is_refused_by_name(name: str, value: Any, reason: str) -> None:
    with pytest.raises(ParameterError, match=reason.replace("[", r"\[")):
        apply_overrides(Settings, {name: value})
