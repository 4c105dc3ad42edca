"""What is given to a node must belong to one of its settings classes."""

from dataclasses import dataclass
from typing import Any

import pytest

from flexarm_model.settings.overrides import check_overrides
from flexarm_model.settings.parameters import ParameterError, parameter


@dataclass(frozen=True)
class Rate:
    rate: float = parameter(200.0, "Rate", "Hz", 1.0, 1000.0)


@dataclass(frozen=True)
class Law:
    law: str = parameter("mpc", "Law", choices=("mpc", "lqr"))


def test_fields_of_either_class_are_taken() -> None:
    check_overrides((Rate, Law), {"rate": 3, "law": "lqr"})
    check_overrides((Rate, Law), {})


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"raet": 3}, "raet: unknown; allowed: law, rate"),
        ({"law": "pd"}, "law: 'pd' is not one of mpc, lqr"),
        ({"rate": 0.5}, "rate: 0.5"),
    ],
)
def test_what_belongs_to_none_or_is_out_of_range_is_refused_by_name(
    given: dict[str, Any], reason: str
) -> None:
    with pytest.raises(ParameterError, match=reason):
        check_overrides((Rate, Law), given)
