"""How a flexible body is damped: by a ratio for every mode, by Rayleigh's two factors, or by both.

``rayleigh: {alpha: 0.3 1/s, beta: 20 us}`` is ``D = alpha M + beta K`` of the arm with its motors locked, as
far as this body holds a mode's strain energy: where all of it, ``zeta = alpha / (2 omega) + beta omega / 2``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from flexarm_model.settings.strict_yaml import Section


class Damping(NamedTuple):
    """What is said of a body.

    Attributes:
        ratio: Of every mode [1].
        time: Damping over stiffness, beta [s].
        rate: Damping over mass, alpha [1/s].
    """

    ratio: float
    time: float
    rate: float


def read_damping(section: Section, instead: Sequence[str] = ("rayleigh",)) -> Damping:
    """Read ``damping_ratio`` and ``rayleigh``.

    Args:
        section: Of the body.
        instead: Keys one of which makes the ratio 0 where it is not given.

    Raises:
        ConfigError: A value is wrong, or all those keys are missing; see ``strict_yaml``.
    """
    rate, time = 0.0, 0.0
    if section.has("rayleigh"):
        inner = section.section("rayleigh")
        rate = inner.quantity("alpha", "damping rate", at_least=0.0)
        time = inner.quantity("beta", "time", at_least=0.0)
        inner.done()
    default = 0.0 if any([section.has(key) for key in instead]) else None
    ratio = section.quantity("damping_ratio", "ratio", default, at_least=0.0, below=1.0)
    return Damping(ratio, time, rate)
