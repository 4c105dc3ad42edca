"""What to excite an arm with: band, resolution and amplitude from the served model and the arm's limits.

The band reaches from half the slowest mode of free motors to a quarter above the fastest served one, as far
as the rate allows; a period has two lines per bandwidth of the narrowest. Every axis gets as much torque as
alone would use what is allowed of the first limit that binds; then all together are scaled until no run
exceeds it. Allowed is the share that was asked for; of a torque's rate, which harms nothing, three times as
much, but never so much that the guard would change the signal.

With several axes the runs carry the signs of a Hadamard matrix, so that all axes push in every run and yet
can be told apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import hadamard

from flexarm_bringup.excite.held_arm import Answer, HeldArm
from flexarm_model.identification.excitation import Excitation, excitation

Array = NDArray[np.float64]
BELOW, ABOVE = 0.5, 1.25  # ends of the band over the slowest and the fastest mode
USABLE = 1 / 2.56  # of the rate
LINES_PER_BANDWIDTH = 2.0
SHORTEST, LONGEST = 4.0, 40.0  # of a period [s]
RATE_SHARES = 3.0  # shares that may be used of a torque's rate
MOST_RATE = 0.9  # of it in any case; the rest is for what noise and an arm unlike the model add
LEAST_ROOM = 1e-3  # of a limit; with less there is nothing to excite with
DIED_OUT = 9.0  # time constants of the slowest decay until nothing is left of the start, in a softer arm too


@dataclass(frozen=True)
class Wish:
    """What was asked; None leaves the choice to the model.

    Attributes:
        signal: A key of ``SIGNALS``.
        band_hz: Band [Hz].
        resolution_hz: Distance of the lines [Hz]; its inverse is the period.
        periods: Periods recorded per run [1].
        share: Of every limit that may be used [1].
    """

    signal: str = "multisine"
    band_hz: tuple[float, float] | None = None
    resolution_hz: float | None = None
    periods: int = 4
    share: float = 0.3


@dataclass(frozen=True)
class Plan:
    """What will be done.

    Attributes:
        excitation: One period with peak 1.
        signs: Of every axis in every run, (runs, n_theta).
        amplitude: Peak torque added per axis [N m or N], (n_theta,).
        binding: The limit that binds, in words.
        used: Share of it that the model predicts [1].
        skipped: Periods before the record begins [1].
        periods: Periods recorded [1].
        mirrored: Served modes that sampling shows inside the band where there is none, in words.
        effort: Limit of the drives' torque [N m or N], (n_theta,); empty where it is not known.
        effort_rate: Limit of its rate [N m/s or N/s], (n_theta,); empty where it is not known.
    """

    excitation: Excitation
    signs: Array
    amplitude: Array
    binding: str
    used: float
    skipped: int
    periods: int
    mirrored: tuple[str, ...] = ()
    effort: tuple[float, ...] = ()
    effort_rate: tuple[float, ...] = ()

    def added(self, run: int) -> Array:
        """Return the torque added in a run, the periods before the record too, (n, n_theta)."""
        one = self.excitation.signal[:, None] * (self.signs[run] * self.amplitude)
        return np.asarray(np.tile(one, (self.skipped + self.periods, 1)))

    @property
    def seconds(self) -> float:
        """Time that all runs take [s]."""
        return len(self.signs) * (self.skipped + self.periods) * self.excitation.period


def plan_excitation(arm: HeldArm, wish: Wish) -> Plan:
    """Return the plan for an arm.

    Raises:
        ValueError: The wish does not fit the arm; says why.
    """
    refuse_without_room(arm)
    elastic = arm.elastic_poles
    band = wish.band_hz or _band(arm)
    bandwidth = 2 * float((-elastic.real).min()) / (2 * np.pi)
    period = float(np.clip(LINES_PER_BANDWIDTH / bandwidth, SHORTEST, LONGEST))
    period = 1.0 / wish.resolution_hz if wish.resolution_hz else period
    signal = excitation(wish.signal, band, 1.0 / arm.dt, period)
    skipped = max(1, int(np.ceil(DIED_OUT / (np.pi * bandwidth * signal.period))))
    m = arm.model.n_theta
    signs = np.asarray(hadamard(1 << (m - 1).bit_length())[:, :m], float)
    each = [_worst(arm, np.outer(signal.signal, row), wish.share) for row in np.eye(m)]
    alone = np.array([1.0 / use.of_allowed for use in each])
    worst = max(_worst(arm, np.outer(signal.signal, row * alone), wish.share) for row in signs)
    scale = min(1.0, 1.0 / worst.of_allowed)
    mirrored = _mirrored(np.asarray(abs(elastic) / (2 * np.pi)), 1.0 / arm.dt, band)
    axes = arm.config.actuated.values()
    return Plan(
        signal, signs, alone * scale, worst.limit, worst.used * scale, skipped, wish.periods, mirrored,
        tuple(axis.effort for axis in axes), tuple(axis.effort_rate for axis in axes),
    )  # fmt: skip


def refuse_without_room(arm: HeldArm) -> None:
    """Refuse an arm that cannot be excited, or has no mode that its rate can show.

    Raises:
        ValueError: Says why, and what is expected.
    """
    name, pose = arm.config.name, np.round(arm.config.home, 6).tolist()
    if not arm.model.n_eta:
        raise ValueError(f"{name} serves no mode: a rigid arm has none to identify; see --joints")
    slowest, usable = float(abs(arm.elastic_poles).min()) / (2 * np.pi), USABLE / arm.dt
    if slowest > usable:
        raise ValueError(
            f"{name}: its slowest mode, {slowest:.4g} Hz, lies above {usable:.4g} Hz, which is what "
            f"samples at {1 / arm.dt:g} Hz can show; expected a rate of {slowest / USABLE:.4g} Hz or more"
        )
    full = [
        limit
        for limit, (room, size) in arm.rooms().items()
        if room <= LEAST_ROOM * (size if np.isfinite(size) else 0.0)
    ]
    if full:
        raise ValueError(
            f"{name}: at rest at {pose} nothing is left of {', '.join(full)}; expected another pose (--pose)"
        )


def _mirrored(f_hz: Array, rate_hz: float, band_hz: tuple[float, float]) -> tuple[str, ...]:
    """Return modes that samples show at another frequency within the band."""
    seen = abs(f_hz - rate_hz * np.round(f_hz / rate_hz))
    inside = (f_hz > rate_hz / 2) & (seen >= band_hz[0]) & (seen <= band_hz[1])
    return tuple(f"{f:.4g} Hz at {at:.4g} Hz" for f, at in zip(f_hz[inside], seen[inside], strict=True))


def _band(arm: HeldArm) -> tuple[float, float]:
    f_hz = abs(arm.elastic_poles) / (2 * np.pi)
    return BELOW * float(f_hz.min()), min(ABOVE * float(f_hz.max()), USABLE / arm.dt)


class _Use(NamedTuple):
    """What is used of a limit: over what is allowed, the limit's name, over what it leaves [1]."""

    of_allowed: float
    limit: str
    used: float


def _worst(arm: HeldArm, added: Array, share: float) -> _Use:
    """Return the use of the limit of which two periods from rest use most."""
    answer = arm.respond(np.vstack([added, added]))
    uses = [_Use(used / share, limit, used) for limit, used in _uses(arm, answer).items()]
    most = min(RATE_SHARES * share, MOST_RATE)
    return max(uses + [_Use(used / most, limit, used) for limit, used in _rates(arm, answer).items()])


def _uses(arm: HeldArm, answer: Answer) -> dict[str, float]:
    """Return the share of what every limit leaves at rest, by name."""
    uses: dict[str, float] = {}
    rooms = arm.rooms()
    for i, (name, axis) in enumerate(arm.config.actuated.items()):
        theta, (distance, _) = abs(answer.theta[:, i]).max(), rooms[f"range of {name}"]
        speed = min(axis.velocity, arm.ranges[i].allowed(distance))
        uses |= {
            f"torque of {name}": _share(abs(answer.tau[:, i]).max(), rooms[f"torque of {name}"][0]),
            f"velocity of {name}": _share(abs(answer.theta_dot[:, i]).max(), speed),
            f"range of {name}": _share(theta, distance),
        }
    for row, name in arm.sensed_rows():
        uses[f"range of {name}"] = _share(abs(answer.y[:, row]).max(), rooms[f"range of {name}"][0])
    return uses


def _rates(arm: HeldArm, answer: Answer) -> dict[str, float]:
    """Return the share of every torque's rate, by name."""
    rates = abs(np.diff(answer.tau, axis=0, prepend=0.0)).max(axis=0) / arm.dt
    return {
        f"torque rate of {name}": _share(rate, axis.effort_rate)
        for (name, axis), rate in zip(arm.config.actuated.items(), rates, strict=True)
    }


def _share(value: float, room: float) -> float:
    return float(value / max(room, 1e-9 * max(value, 1.0)))
