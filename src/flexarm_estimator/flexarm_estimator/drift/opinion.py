"""What the estimator holds of the sensors, and so what the drift watch must not take for the arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

OFF = "switched off in the estimator"


def _nothing() -> Mapping[str, Any]:
    return MappingProxyType({})


@dataclass(frozen=True)
class Opinion:
    """Of sensors by name.

    Attributes:
        unused: Why the estimator does not use a sensor.
        channels: Those of a sensor that are switched off.
        doubted: What speaks against a sensor that it still uses.
    """

    unused: Mapping[str, str] = field(default_factory=_nothing)
    channels: Mapping[str, tuple[str, ...]] = field(default_factory=_nothing)
    doubted: Mapping[str, str] = field(default_factory=_nothing)
