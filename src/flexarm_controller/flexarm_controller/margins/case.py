"""The closed loop at one pose with one frequency error: is it stable, and how far from not being so?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.margins.delay_margin import MOST, delay_margin
from flexarm_controller.margins.gain_margin import GainMargin, gain_margin
from flexarm_controller.margins.group_margin import group_delay_margin, group_gain_margin
from flexarm_controller.margins.loop import ClosedLoop
from flexarm_controller.margins.response import Modes, angles_of, decompose, respond, respond_jointly
from flexarm_model.settings.units import RAD_PER_HZ

Array = NDArray[np.float64]
ALL_TORQUES = "all torques"
SURE = 1e-9  # growth per period that is no rounding


@dataclass(frozen=True)
class Margin:
    """How wrong one path of the loop may be.

    Attributes:
        name: "mode_1" on, or all torques.
        frequency: Of the mode with the axes free [Hz]; 0 of the torques.
        gain: Factors on the force.
        delay: Of the force [s].
        is_delay_open: There is no instability up to that delay.
    """

    name: str
    frequency: float
    gain: GainMargin
    delay: float
    is_delay_open: bool


@dataclass(frozen=True)
class Case:
    """Outcome at one pose with one frequency error.

    Attributes:
        pose: Of the actuated axes [rad or m], (n_theta,).
        frequency_error: Real over described frequencies, minus one [1].
        growth: Rate at which the fastest growing (or slowest decaying) motion grows [1/s].
        mode: Mode that takes part in it most, by name; "axes" when it is none.
        frequency: Of that motion as sampled [Hz].
        margins: All torques first, then every mode; empty when the loop is unstable.
        poles: Eigenvalues of the loop, (n_z,).
        pole_modes: Of each, the plant's mode that takes part in it most, (n_z,).
    """

    pose: tuple[float, ...]
    frequency_error: float
    growth: float
    mode: str
    frequency: float
    margins: tuple[Margin, ...]
    poles: NDArray[np.complex128]
    pole_modes: tuple[str, ...]

    @property
    def is_stable(self) -> bool:
        """Whether every motion dies out."""
        return bool(abs(self.poles).max() < 1.0 - SURE)

    def margin(self, name: str) -> Margin:
        """Return the margin of a path of a stable loop.

        Raises:
            KeyError: It has no such path; lists those it has.
        """
        for margin in self.margins:
            if margin.name == name:
                return margin
        known = ", ".join(margin.name for margin in self.margins) or "none, the loop is unstable"
        raise KeyError(f"no path '{name}'; known: {known}")


def examine(loop: ClosedLoop, pose: Array, frequency_error: float, dt: float) -> Case:
    """Examine a closed loop.

    Args:
        loop: With the full plant.
        pose: Where it was linearised, (n_theta,).
        frequency_error: Of that plant [1].
        dt: Control period [s].
    """
    modes = decompose(loop.A)
    names = tuple(strongest(modes, loop, k) for k in range(modes.values.size))
    worst = int(abs(modes.values).argmax())
    is_stable = abs(modes.values[worst]) < 1.0 - SURE
    return Case(
        tuple(float(value) for value in pose),
        frequency_error,
        float(np.log(abs(modes.values[worst])) / dt),
        names[worst],
        float(abs(np.angle(modes.values[worst])) / dt / RAD_PER_HZ),
        _margins(loop, modes, dt) if is_stable else (),
        modes.values,
        names,
    )


def strongest(modes: Modes, loop: ClosedLoop, k: int) -> str:
    """Return the name of the plant's mode that takes part in eigenvalue k most."""
    n = len(loop.plant.names)
    share = modes.participation(k)[: 2 * n]
    return loop.plant.names[int((share[:n] + share[n:]).argmax())]


def _margins(loop: ClosedLoop, modes: Modes, dt: float) -> tuple[Margin, ...]:
    plant, angles = loop.plant, angles_of(modes.values)
    forces = plant.b @ loop.torque
    answer = respond(modes, forces, loop.enter, angles)
    early = np.array([respond(modes, forces, part, angles) for part in loop.early])
    found = [_all_torques(loop, modes, angles, dt)]
    for j, name in enumerate(plant.names):
        if name.startswith("mode"):
            delay = delay_margin(answer[j], early[:, j], angles)
            found.append(_margin(name, plant.omega[j] / RAD_PER_HZ, gain_margin(answer[j]), delay, dt))
    return tuple(found)


def _all_torques(loop: ClosedLoop, modes: Modes, angles: Array, dt: float) -> Margin:
    b = loop.plant.b
    answer = respond_jointly(modes, loop.torque, loop.enter @ b, angles)
    early = np.array([respond_jointly(modes, loop.torque, part @ b, angles) for part in loop.early])
    delay = group_delay_margin(answer, early, angles)
    return _margin(ALL_TORQUES, 0.0, group_gain_margin(answer), delay, dt)


def _margin(name: str, frequency: float, gain: GainMargin, periods: float, dt: float) -> Margin:
    return Margin(name, float(frequency), gain, periods * dt, periods >= MOST)
