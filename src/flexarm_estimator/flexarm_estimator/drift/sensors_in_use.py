"""The sensors that the drift watch goes by: those that speak and that the estimator believes."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.drift.attendance import Attendance
from flexarm_estimator.drift.opinion import OFF, Opinion
from flexarm_estimator.judging.switched_channels import Narrowing, all_channels, switch
from flexarm_estimator.measurement import Measurement
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
SILENT = "silent"


class SensorsInUse:
    """See the module.

    Attributes:
        specs: Of the sensors in use, with the channels in use; of all when none is left to go by.
        channels: In use, of sensors that speak in every period: sensor and channel.
        left_out: Why a sensor, or some of its channels, is not in use, by name.
        is_blind: None that speaks in every period is left.
        has_changed: The last ``read`` found others in use than before.
        is_misled: The same, and what was said before of who is left out now was not true of the arm.
    """

    def __init__(self, specs: tuple[SensorSpec, ...], prompt: Collection[str], dt: float) -> None:
        """Begin with all of them.

        Args:
            specs: Of the description.
            prompt: Names of those that speak in every period; nobody asks for the others.
            dt: Control period [s].
        """
        self._described, self._prompt = specs, tuple(prompt)
        self._attendance, self._opinion, self._is_new = Attendance(prompt, dt), Opinion(), False
        self.channels: frozenset[tuple[str, str]] = frozenset()
        self.left_out: dict[str, str] = {}
        self.has_changed = self.is_misled = False
        self._choose()

    @property
    def doubted(self) -> dict[str, str]:
        """What speaks against sensors in use, by name."""
        in_use = set(self._prompt) - set(self.left_out)
        return {name: why for name, why in self._opinion.doubted.items() if name in in_use}

    @property
    def said(self) -> str:
        """Who is left out and who is doubted, in a sentence; empty when nobody is."""
        out, doubted = _listed(self.left_out), _listed(self.doubted)
        said = [f"{'tells nothing' if self.is_blind else 'goes on'} without {out}"] if out else []
        return "; ".join([*said, f"in doubt: {doubted}"] if doubted else said)

    def heed(self, opinion: Opinion) -> None:
        """Take what the estimator holds of the sensors; it acts from the next ``read`` on."""
        self._opinion, self._is_new = opinion, True

    def read(self, samples: Mapping[str, Array]) -> dict[str, Array]:
        """Return what of the samples of a period is fit for use.

        Args:
            samples: By sensor, all of its channels.
        """
        self.has_changed = self.is_misled = False
        if self._is_new:
            self._choose()
        taken = [Measurement(name, 0.0, samples[name]) for name in self._prompt if name in samples]
        fit = {
            name: y
            for name, _, y, _ in self._narrowing.narrow(taken)
            if y.size == self._sizes[name] and bool(np.isfinite(y).all())
        }
        if self._attendance.note(fit):
            self._choose()
        return fit

    def _choose(self) -> None:
        """Find who is in use."""
        unused = {name: why for name, why in self._opinion.unused.items() if name in self._prompt}
        narrowed = tuple(self._narrow(spec) for spec in self._described)
        self._narrowing, self._is_new = Narrowing(narrowed), False
        self._sizes = {spec.name: len(spec.channels) for spec in narrowed}
        false = {spec.name: _said(spec) for spec in narrowed if spec.mounted is not None} | unused
        silent = dict.fromkeys(self._attendance.silent, SILENT)
        self.left_out = false | silent | unused
        heard = tuple(spec for spec in narrowed if spec.name not in silent and spec.name not in unused)
        used = frozenset((s.name, c) for s in heard if s.name in self._prompt for c in s.channels)
        self.is_blind = not used
        self.specs = heard if used else narrowed
        self.has_changed |= used != self.channels
        self.is_misled |= any(name in false and name not in silent for name, _ in self.channels - used)
        self.channels = used

    def _narrow(self, spec: SensorSpec) -> SensorSpec:
        """Return a sensor without the channels that are switched off, where it can be without them."""
        off = self._opinion.channels.get(spec.name, ()) if spec.name in self._prompt else ()
        try:
            return switch(spec, off, False) if off else spec
        except ValueError:  # nor has the estimator taken it
            return spec


def _said(spec: SensorSpec) -> str:
    off = [channel for channel in all_channels(spec) if channel not in spec.channels]
    return f"{', '.join(off)} {OFF}"


def _listed(whys: Mapping[str, str]) -> str:
    return ", ".join(f"{name} ({why})" for name, why in sorted(whys.items()))
