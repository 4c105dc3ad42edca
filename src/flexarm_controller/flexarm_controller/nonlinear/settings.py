"""Settings of the nonlinear controller; weights, horizon and blocks are those of ``MpcConfig``."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flexarm_model.settings.parameters import parameter, validate


@dataclass(frozen=True)
class NmpcConfig:
    """What the nonlinear controller adds to the settings of the linear one."""

    mode_turn: float = parameter(
        math.pi,
        "Angle a mode may turn in a period; faster ones cannot be controlled and follow statically.",
        "rad",
        minimum=0.1,
        maximum=100.0,
    )
    sqp_iterations: int = parameter(
        1, "Quadratic programs per period; 1 is the real-time iteration.", minimum=1, maximum=50
    )
    qp_iterations: int = parameter(500, "Cap on changes of the active set.", minimum=1)

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ParameterError: A value is outside its range.
        """
        validate(self)
