"""Seed 001 through the pipeline: the served model of a preset, struck where the paper struck its machine."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.share import share_path
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.half_power import HalfPower, LinesTooCoarseError, half_power
from flexarm_model.modal.model_frf import displacement_row, model_frf
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

PRESETS = ("sim", "exp")
ROWS = {  # outputs along x, y, z where the paper measures
    "tool": tuple(f"tool_accelerometer.{axis}" for axis in "xyz"),
    "platform": tuple(f"platform_accelerometer.{axis}" for axis in "xyz"),
}
GRID = np.arange(1.0, 801.0)  # Hz; the paper sweeps 0.01 to 800 Hz
FIRST, SECOND = 0, 1  # the two modes of the paper


@dataclass(frozen=True)
class Machine:
    """One preset of the description and its served model.

    Attributes:
        config: What was modelled.
        tree: Its dynamics.
        model: With the drives held.
    """

    config: ManipulatorConfig
    tree: ReducedTree
    model: ReducedModel

    @cached_property
    def f_hz(self) -> Array:
        """Natural frequencies, drives held [Hz], (r,)."""
        return np.asarray(self.model.omega / (2.0 * np.pi))

    def motion(self, point: str) -> Array:
        """Return the motion of "tool" or "platform" in every mode [kg^-1/2], (3, r)."""
        return np.array([displacement_row(self.model, row)[self.model.n_theta :] for row in ROWS[point]])

    def stiffness(self, point: str, mode: int = SECOND) -> float:
        """Return the modal stiffness along the motion of a point [N/m]."""
        return float(self.model.omega[mode] ** 2 / np.sum(self.motion(point)[:, mode] ** 2))

    def force(self, point: str, degrees: float = 0.0) -> Array:
        """Return the direction of mode 2 at a point, turned towards mode 1 there, (3,)."""
        along, other = (self.motion(point)[:, mode] for mode in (SECOND, FIRST))
        along = along / np.linalg.norm(along)
        across = other - along * (other @ along)
        angle = np.radians(degrees)
        return np.asarray(np.cos(angle) * along + np.sin(angle) * across / np.linalg.norm(across))

    def drive_point(self, point: str, force: Array, f_hz: Array = GRID) -> Frf:
        """Return the receptances along x, y, z [m/N] for a force at the same point, (k, 3, 1)."""
        matrix = model_frf(self.model, f_hz, ROWS[point], ROWS[point]).converted("receptance")
        return Frf(matrix.f_hz, matrix.H @ force[:, None])

    def reading(self, point: str) -> HalfPower | None:
        """Return what half-power reads at mode 2, force along it, in the paper's way.

        None where lines 1 Hz apart are too coarse for it.
        """
        frf = self.drive_point(point, self.force(point))
        try:
            return half_power(frf.f_hz, magnitude(frf), self.f_hz[SECOND], interpolate=False)
        except LinesTooCoarseError:
            return None


def load_machine(preset: str) -> Machine:
    """Return a preset of the description as served at its home pose; it is too small to compile."""
    config = load_config(share_path("config/manipulators/spatial_3tpt.yaml"), preset)
    tree = ReducedTree(config, use_compiler=False)
    return Machine(config, tree, linearize(tree))


def magnitude(frf: Frf) -> Array:
    """Return the magnitude over x, y, z of the responses to the only input, (k,); the paper's "space"."""
    return np.asarray(np.linalg.norm(frf.H[:, :, 0], axis=1))
