"""What is said of a mode: its running frequency and damping, and whether it has drifted.

A change is told when it is as large as the settings say, known to so many sigma, and has lasted; it is taken
back when it has become smaller than two thirds of that. What to do about it says ``proposal``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.drift.mode_drift import DAMPING_PRIOR, STIFFNESS_PRIOR, Deltas
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.units import RAD_PER_HZ

Array = NDArray[np.float64]
BACK = 2.0 / 3.0  # of a change that is told, below which it is taken back
KNOWN = 0.5  # of the sigma before the measurement, from which the motion has told a value
CERTAIN = 0.03  # one sigma of the relative frequency below which it is called known; alarms ask for more
DAMPED = 3.0  # times as much damping as there should be: so reads a mode that runs elsewhere
DOUBTFUL = 2.0  # the same of one that may
LEAST_STIFFNESS = 0.01  # of the described: what is left of omega^2 at least
PERCENT = 100.0


@dataclass(frozen=True)
class Healthy:
    """What a mode should read.

    Attributes:
        change: Of the frequency against the description, and one sigma [1].
        change_sigma: The same.
        zeta: Damping ratio, and one sigma [1].
        zeta_sigma: The same.
    """

    change: float
    change_sigma: float
    zeta: float
    zeta_sigma: float


@dataclass(frozen=True)
class ModeNow:
    """A mode as it runs.

    Attributes:
        name: "mode_1" on.
        described_hz: Frequency in the model, axes locked [Hz].
        f_hz: Running frequency, and one sigma [Hz].
        f_sigma_hz: The same.
        described_zeta: Damping ratio in the model [1].
        zeta: Running damping ratio, and one sigma [1].
        zeta_sigma: The same.
        is_known: The motion has told the frequency; how well says its sigma.
        is_damping_known: The motion has told the damping.
        change: Relative change of frequency against the description, and one sigma [1].
        change_sigma: The same.
        healthy: What it should read; None: as described.
        is_settled: It has read near the point about which the watch is linear for a while.
    """

    name: str
    described_hz: float
    f_hz: float
    f_sigma_hz: float
    described_zeta: float
    zeta: float
    zeta_sigma: float
    is_known: bool
    is_damping_known: bool
    change: float
    change_sigma: float
    healthy: Healthy | None = None
    is_settled: bool = True

    @property
    def is_damped(self) -> bool:
        """Whether it reads as if damped many times as much, as a mode does that runs elsewhere."""
        return self._damping_ratio > DAMPED

    @property
    def is_within_reach(self) -> bool:
        """Whether the motion has told its frequency, and slopes hold where it reads."""
        return self.is_known and self.is_settled and self._damping_ratio < DOUBTFUL

    @property
    def _damping_ratio(self) -> float:
        return self.zeta / max(self.expected.zeta, self.described_zeta)

    @property
    def is_certain(self) -> bool:
        """Whether its frequency is known: within reach, and to less than is told as a drift."""
        return self.is_within_reach and self.change_sigma < CERTAIN

    @property
    def expected(self) -> Healthy:
        """What it should read."""
        return self.healthy or Healthy(0.0, 0.0, self.described_zeta, 0.0)

    @property
    def drift(self) -> float:
        """Relative change of frequency against what it should be [1]."""
        return (1.0 + self.change) / (1.0 + self.expected.change) - 1.0

    @property
    def drift_sigma(self) -> float:
        """One sigma of it [1]."""
        return float(np.hypot(self.change_sigma, self.expected.change_sigma))


def modes_now(model: ReducedModel, modes: Sequence[int], deltas: Deltas, at: Array) -> tuple[ModeNow, ...]:
    """Return the watched modes as they run.

    Args:
        model: As served.
        modes: Places of the watched ones among all.
        deltas: Of these, against the point about which the watch is linear.
        at: Frequencies there over the served [1], (modes,).
    """
    found = []
    for k, mode in enumerate(modes):
        step = float(np.sqrt(max(1.0 + deltas.stiffness[k], LEAST_STIFFNESS)))
        ratio, sigma = float(at[k]) * step, float(deltas.stiffness_sigma[k])
        change_sigma = float(at[k]) * sigma / (2.0 * step)
        f, zeta = float(model.omega[mode]) / RAD_PER_HZ, float(model.zeta[mode])
        found.append(ModeNow(
            f"mode_{mode + 1}", f, f * ratio, f * change_sigma,
            zeta, zeta * float(1.0 + deltas.damping[k]) / step,
            zeta * float(deltas.damping_sigma[k]) / step,
            bool(deltas.stiffness_sigma[k] < KNOWN * STIFFNESS_PRIOR),
            bool(deltas.damping_sigma[k] < KNOWN * DAMPING_PRIOR), ratio - 1.0, change_sigma,
        ))  # fmt: skip
    return tuple(found)


@dataclass(frozen=True)
class Changed:
    """What of a mode has changed by so much that it is told.

    Attributes:
        frequency: It has.
        damping: It has.
        is_undamped: The damping has, and within one sigma none is left.
    """

    frequency: bool
    damping: bool
    is_undamped: bool = False


class Alarms:
    """Which modes are said to have drifted, and since when.

    Attributes:
        told: What is said of those that have drifted, by name.
        newest: When the last of them began to be told [s].
    """

    def __init__(self, config: DriftConfig) -> None:
        """Begin without any."""
        self._config = config
        self._since: dict[str, float] = {}
        self._by: dict[str, Changed] = {}
        self.told: dict[str, str] = {}
        self.newest = -math.inf  # s; when the last one began

    @property
    def is_damping_alone(self) -> bool:
        """Whether modes are told, and none of them for its frequency."""
        return bool(self.told) and not any(self._by[name].frequency for name in self.told)

    @property
    def undamped(self) -> tuple[str, ...]:
        """Modes that are told to have no damping above one sigma: every arm damps, so a sensor is false."""
        return tuple(name for name in self.told if self._by[name].is_undamped)

    def look(self, modes: Sequence[ModeNow], t: float) -> None:
        """Look at the modes at a time [s]; ``told`` then has a sentence for every one that has drifted."""
        for mode in modes:
            changed = self._changed(mode)
            if changed.frequency or changed.damping:
                since = self._since.setdefault(mode.name, t)
                if t - since >= self._config.patience or mode.name in self.told:
                    self._by[mode.name] = changed
                    self.newest = self.newest if mode.name in self.told else t
                    self.told[mode.name] = sentence(mode, changed)
            else:
                self._since.pop(mode.name, None)
                if mode.name in self.told and self._is_back(mode):
                    del self.told[mode.name]

    def _changed(self, mode: ModeNow) -> Changed:
        sigmas, expected = self._config.sigmas, mode.expected
        drift, damping = self._told_from(mode)
        sigma = float(np.hypot(mode.zeta_sigma, expected.zeta_sigma))
        by_frequency = abs(mode.drift) >= max(drift, sigmas * mode.drift_sigma)
        by_damping = abs(mode.zeta - expected.zeta) >= max(damping, sigmas * sigma)
        damping_changed = by_damping and mode.is_damping_known and mode.is_settled
        return Changed(
            by_frequency and mode.is_known, damping_changed, damping_changed and mode.zeta <= mode.zeta_sigma
        )

    def _is_back(self, mode: ModeNow) -> bool:
        """Return whether all that was told of a mode is known to be small again."""
        said, (drift, damping) = self._by[mode.name], self._told_from(mode)
        by_frequency = mode.is_within_reach and abs(mode.drift) < BACK * drift
        by_damping = mode.is_damping_known and abs(mode.zeta - mode.expected.zeta) < BACK * damping
        return (by_frequency or not said.frequency) and (by_damping or not said.damping)

    def _told_from(self, mode: ModeNow) -> tuple[float, float]:
        """Return the change of frequency, relative, and of the damping ratio from which they are told."""
        c = self._config
        return c.frequency_change, c.damping_change * max(mode.expected.zeta, mode.described_zeta)


def sentence(mode: ModeNow, changed: Changed) -> str:
    """Return what is said of a mode that has drifted: the numbers of what has changed, and no others."""
    name, is_described = mode.name.replace("_", " "), mode.healthy is None
    said = []
    if changed.frequency:
        before = "described are" if is_described else "at the start it was"
        expected_hz = mode.described_hz * (1.0 + mode.expected.change)
        said.append(
            f"runs at {mode.f_hz:.3g} Hz +- {mode.f_sigma_hz:.1g}, {before} "
            f"{expected_hz:.3g} Hz ({PERCENT * mode.drift:+.1f} %)"
        )
    if changed.damping:
        before = "described is" if is_described else "at the start it was"
        said.append(
            f"has a damping of {PERCENT * mode.zeta:.2g} +- {PERCENT * mode.zeta_sigma:.1g} %, {before} "
            f"{PERCENT * mode.expected.zeta:.2g} %"
        )
    return f"{name} {' and '.join(said)}"
