"""Velocities that cannot be: of an axis far beyond its limit, or of a mode that would tear a gauge off.

The guard stops an axis at 1.2 times its limit. A mode that passes its rest at ``eta'`` swings out to
``eta' / omega``, and what a gauge reads of it there has a bound as everything that it reads.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.state.sensors import LinearRows
from flexarm_estimator.state.state_layout import StateLayout
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
MARGIN = 2.0  # of the velocity limit of an axis; beyond what a guard that reacts late lets it reach


class PossibleMotions:
    """What encoders and gauges know of velocities."""

    def __init__(
        self, specs: Sequence[SensorSpec], rows: dict[str, LinearRows], layout: StateLayout, omega: Array
    ) -> None:
        """Take the rows of the sensors, by name, and the frequencies of the modes [rad/s], (n_eta,)."""
        self._specs, self._rows, self._layout, self._omega = specs, rows, layout, omega

    def refusal(self, x: Array) -> str:
        """Return the field of a state ``x``, (n_x,), that cannot be, and why; empty where all can."""
        return self._refuse_axes(x) or self._refuse_modes(x)

    def _refuse_axes(self, x: Array) -> str:
        layout = self._layout
        for spec in self._specs:
            if spec.kind != "encoder":
                continue
            C, most = self._rows[spec.name].C, MARGIN * spec.velocity
            velocity = float(C[0, layout.theta] @ x[layout.theta_dot])
            if not abs(velocity) <= most:
                unit = f"{SENSOR_KINDS[spec.kind].units(spec.site)[spec.channels[0]]}/s"
                allowed = f"allowed: up to {most:.6g} {unit}, {MARGIN:g} times its limit"
                return f"theta_dot: {spec.site} would move at {velocity:.6g} {unit}; {allowed}"
        return ""

    def _refuse_modes(self, x: Array) -> str:
        layout = self._layout
        swings = x[layout.eta_dot] / self._omega
        for spec in self._specs:
            if spec.kind != "strain_gauge":
                continue
            readings = abs(self._rows[spec.name].C[0, layout.eta] * swings)
            for mode, reading in enumerate(readings.tolist(), start=1):
                if not reading <= spec.high:
                    can = f"would read {reading:.6g}; it can read up to {spec.high:.6g}"
                    return f"eta_dot: where mode {mode} swings to then {spec.name} ({spec.site}) {can}"
        return ""
