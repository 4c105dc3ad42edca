"""Which sensors see a mode, and which motors drive it.

Every mode swings with the same small energy E, so that modes can be compared whatever they are
scaled with: its amplitude is ``a = sqrt(2 E) / omega``. A sensor row then reads, in units of its noise::

    signal = a |C_pos + j omega C_vel - omega^2 C_acc| phi / sigma

and in the n samples of a period, of which either phase of the swing has half, ``sqrt(n / 2)`` times that. A
motor at its limit changes the amplitude, in a quasi-static push, by the share::

    drive = |psi' M^-1 B| tau_max / (omega^2 a)

of it, with ``psi = M phi``, or ``psi = phi`` where the axes are held: those modes' coordinates have mass 1.
The axes are free in that push even then. Close modes are judged together: one sensor row sees one combination
of a double mode and never the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.modes import Modes, model_modes
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.modal.tracking import group_modes
from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.served.tip_moves import are_felt, tip_moves

Array = NDArray[np.float64]

ENERGY = 1e-6  # J; the first mode of a light arm then moves its tip by about 0.1 mm
TIP_AMPLITUDE = 1e-4  # m; an arm that shakes by this is not at rest
SEEN = 1.0  # signal that one sample shows: as large as the noise
DRIVEN = 0.1  # share of the swing that a motor takes up in a quasi-static push
CLOSE = 1e-3  # relative distance of frequencies below which modes are judged together


@dataclass(frozen=True)
class Reach:
    """What reaches the modes.

    Attributes:
        names: Of the sensor rows or motors, (m,).
        share: Signal over noise, or drive over swing, of every mode and name [1], (r, m).
        weakest: The same of the combination of close modes that is reached least, all names together, (r,).
        enough: What ``weakest`` must reach [1].
    """

    names: tuple[str, ...]
    share: Array
    weakest: Array
    enough: float

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Whether a mode is reached, (r,)."""
        return self.weakest >= self.enough

    def by(self, mode: int) -> tuple[str, ...]:
        """Return the names that reach a mode, strongest first."""
        order = np.argsort(-self.share[mode], kind="stable")
        return tuple(self.names[i] for i in order if self.share[mode, i] >= self.enough)


@dataclass(frozen=True)
class ModeReach:
    """The table of a model.

    Attributes:
        modes: The modes it is about.
        sensors: What the mounted sensors see.
        motors: What the motors drive.
        possible: What sensors that are not mounted would see.
        over_period: What the mounted sensors see with all samples of a period of the mode.
    """

    modes: Modes
    sensors: Reach
    motors: Reach
    possible: Reach
    over_period: Reach

    def verdict(self, mode: int) -> str:
        """Return one sentence on a mode, numbered from 0: who sees it, who could, who drives it."""
        could = ", ".join(self.possible.by(mode)) or "no sensor known here"
        seen = ", ".join(self.sensors.by(mode)) or "nothing mounted alone"
        if not self.sensors.reached[mode] and self.over_period.reached[mode]:
            seen = f"{', '.join(self.over_period.by(mode)) or 'all together'} over a period"
        elif not self.sensors.reached[mode]:
            part = " (only a part of a multiple mode)" if self.sensors.by(mode) else ""
            seen = f"{seen}{part}; could be seen by {could}"
        driven = ", ".join(self.motors.by(mode)) or "no motor"
        if not self.motors.reached[mode] and self.motors.by(mode):
            driven += " (only a part of a multiple mode)"
        return f"mode {mode + 1}, {self.modes.f_hz[mode]:.4g} Hz: seen by {seen}; driven by {driven}"


@dataclass(frozen=True)
class Swing:
    """What counts as seen and driven.

    Attributes:
        energy: Of every mode [J].
        seen: Signal over noise that is enough [1].
        driven: Share of the swing that is enough [1].
        locked: Modes with the actuated axes held, or free to recoil.
        rates: Samples per second of sensor rows "sensor.channel" [Hz]; of others one sample counts.
    """

    energy: float = ENERGY
    seen: float = SEEN
    driven: float = DRIVEN
    locked: bool = True
    rates: Mapping[str, float] = field(default_factory=dict)


def mode_reach(
    model: ReducedModel,
    sigma: Mapping[str, float],
    effort: Array,
    possible: tuple[Outputs, Mapping[str, float]] | None = None,
    swing: Swing | None = None,
) -> ModeReach:
    """Return which sensors see and which motors drive every elastic mode.

    Args:
        model: The served model.
        sigma: Noise of every mounted row "sensor.channel", SI.
        effort: Largest torque or force of every axis [N m or N], (n_theta,).
        possible: Rows in the same coordinates that could be mounted and their noise; None for none.
        swing: What counts; None is the default.

    Raises:
        KeyError: A row does not exist; the message lists those that do.
        ValueError: A noise or an effort is not positive, or its number is wrong.
    """
    swing = swing or Swing()
    modes = model_modes(model, swing.locked)
    elastic = modes.omega > 1e-6 * modes.omega.max(initial=0.0)  # the axes' own free motion is no mode
    modes = Modes(modes.omega[elastic], modes.damping[elastic], modes.shapes[:, elastic])
    amplitude = np.sqrt(2 * swing.energy) / modes.omega  # (r,)
    effort = np.asarray(effort, dtype=float)
    if effort.shape != (model.n_theta,) or not (effort > 0.0).all():
        raise ValueError(f"need {model.n_theta} positive efforts, not {effort}")
    push = model.M @ modes.shapes if not swing.locked else modes.shapes
    drive = push.T @ np.linalg.solve(model.M, model.B) * effort / (modes.omega**2 * amplitude)[:, None]
    outputs, noise = possible or (model.outputs, {})
    others = {name: value for name, value in noise.items() if name not in sigma}
    signals = _signals(model.outputs, sigma, modes, amplitude)
    return ModeReach(
        modes,
        _reach(tuple(sigma), signals, modes, swing.seen),
        _reach(model.theta_names, drive, modes, swing.driven),
        _reach(tuple(others), _signals(outputs, others, modes, amplitude), modes, swing.seen),
        _reach(tuple(sigma), signals * _gains(sigma, swing.rates, modes.omega), modes, swing.seen),
    )


def tip_energy(model: ReducedModel, amplitude: float = TIP_AMPLITUDE) -> float:
    """Return the energy with which the mode that moves the tip most moves it by an amplitude [J].

    An energy that suits the machine: a strip shakes its tip with a microjoule, an industrial arm with a
    millijoule.

    Args:
        model: The served model.
        amplitude: Of the tip [m].
    """
    if not are_felt(model):
        return ENERGY
    largest = float((tip_moves(model) / model.omega).max())  # per root of twice the energy
    return (amplitude / largest) ** 2 / 2


def _signals(
    outputs: Outputs, sigma: Mapping[str, float], modes: Modes, amplitude: Array
) -> NDArray[np.complex128]:
    """Return what the rows read over their noise, (r, m)."""
    missing = [name for name in sigma if name not in outputs.names]
    if missing:
        raise KeyError(f"no output row '{missing[0]}'; known: {', '.join(outputs.names)}")
    if not all(value > 0.0 for value in sigma.values()):
        raise ValueError(f"noise must be positive: {dict(sigma)}")
    rows = [outputs.names.index(name) for name in sigma]
    s = 1j * modes.omega
    parts = (outputs.C_pos, outputs.C_vel, outputs.C_acc)
    read = sum((part[rows] @ modes.shapes) * s**power for power, part in enumerate(parts))  # (m, r)
    return np.asarray((read * amplitude).T / np.array(list(sigma.values())), dtype=complex)


def _gains(rows: Iterable[str], rates: Mapping[str, float], omega: Array) -> Array:
    """Return what all samples of a period show over what one does, (r, m); never less."""
    rate = np.array([rates.get(row, 0.0) for row in rows])
    return np.asarray(np.sqrt(np.maximum(rate * (2 * np.pi / omega)[:, None] / 2, 1.0)))


def _reach(names: tuple[str, ...], values: NDArray[Any], modes: Modes, enough: float) -> Reach:
    """Return the table; within close modes the smallest singular value decides."""
    weakest = np.zeros(modes.omega.size)
    for group in group_modes(modes.omega, CLOSE):
        if len(names) >= group.size:
            weakest[group] = np.linalg.svd(values[group], compute_uv=False)[-1]
    return Reach(names, abs(values), weakest, enough)
