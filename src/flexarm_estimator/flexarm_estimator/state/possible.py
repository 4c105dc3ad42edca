"""States that cannot be: where a sensor of the arm's position would read what is physically impossible.

A camera sees no turns and a gauge no axes, so a state a million turns away may agree with both, and with the
encoder out of use nothing would lead it back. What an encoder can read is the range of its axis and a little
more; what a gauge can read ends where it tears off.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.state.sensors import LinearRows
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_KINDS = ("encoder", "strain_gauge")  # what reads the position of the arm, in numbers that have a bound


class PossibleStates:
    """What encoders and gauges would read of a state, and what they can read."""

    def __init__(self, specs: Sequence[SensorSpec], rows: dict[str, LinearRows]) -> None:
        """Take the rows of these sensors, by name, from the served model."""
        bound = [spec for spec in specs if spec.kind in _KINDS]
        self._read = [(spec, rows[spec.name].C, rows[spec.name].D[:, -1]) for spec in bound]

    def refusal(self, x: Array) -> str:
        """Return which sensor cannot read what it would at a state ``x``, (n_x,); empty where all can."""
        for spec, C, constant in self._read:
            for reading in (C.dot(x) + constant).tolist():
                if not spec.low <= reading <= spec.high:  # also NaN
                    unit = SENSOR_KINDS[spec.kind].units(spec.site)[spec.channels[0]]
                    unit = "" if unit == "1" else f" {unit}"
                    can = f"it can read {spec.low:.6g} to {spec.high:.6g}{unit}"
                    return f"{spec.name} ({spec.site}) would read {reading:.6g}{unit}; {can}"
        return ""
