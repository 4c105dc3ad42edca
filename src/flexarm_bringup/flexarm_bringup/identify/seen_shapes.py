"""Shapes of identified modes at the sensors of a description, beside those of its own modes.

Used are modes that stand alone: of close ones any combination is a shape. The input that drives a mode most
tells its shape; real parts are taken after a turn of the phase, since the described modes are normal ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.described_shapes import Shapes, in_size
from flexarm_model.identification.modal_misfit import Serve
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.fit import PoleFit
from flexarm_model.tree.sensors import output_names

Array = NDArray[np.float64]
ALONE = 0.05  # relative distance to the next mode from which a mode stands alone


@dataclass(frozen=True)
class SeenShapes:
    """How shapes are compared.

    Attributes:
        described: Shapes of the description at the channels.
        columns: Places of the channels among the measured outputs.
    """

    described: Shapes
    columns: tuple[int, ...]

    def told(self, table: ModeTable, fit: PoleFit) -> ModeTable:
        """Return a table of modes with their shapes, as far as both stand alone."""
        described = self.described({}, table.pose)
        size = np.maximum(abs(described).max(axis=0), np.finfo(float).tiny)
        found = in_size(real_shapes(fit)[:, list(self.columns)], size)
        shapes = np.full((table.f_hz.size, len(self.columns)), np.nan)
        for mode, f_hz in enumerate(table.f_hz):
            if np.isfinite(f_hz):
                at = int(np.argmin(abs(fit.model.f_hz - f_hz)))
                if _stands_alone(fit.model.f_hz, at):
                    shapes[mode] = found[at]
        return replace(table, shapes=shapes, size=size)

    def served(self, modes_of: Serve) -> Serve:
        """Return what serves shapes, too."""

        def serve(changes: Mapping[str, str | float], pose: Array) -> tuple[Array, ...]:
            """Return modes and what the sensors see of their shapes."""
            return (*modes_of(changes, pose), self.described(changes, pose))

        return serve


def find_channels(
    config: ManipulatorConfig, outputs: Sequence[str]
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """Return the places and names of outputs that are channels of the description."""
    known = set(output_names(config))
    found = [(i, name) for i, name in enumerate(outputs) if name in known]
    return tuple(i for i, _ in found), tuple(name for _, name in found)


def real_shapes(fit: PoleFit) -> Array:
    """Return the real shapes of the identified modes, (r, n_out)."""
    residues = fit.model.residues  # (r, n_out, n_in)
    strongest = np.argmax(np.linalg.norm(residues, axis=1), axis=1)
    psi = residues[np.arange(len(residues)), :, strongest]
    size = np.maximum(np.median(abs(psi), axis=0), np.finfo(float).tiny)  # units differ
    turn = np.exp(-0.5j * np.angle(np.sum((psi / size) ** 2, axis=1)))
    return np.asarray((psi * turn[:, None]).real)


def _stands_alone(f_hz: Array, at: int) -> bool:
    others = np.delete(f_hz, at)
    return bool(np.all(abs(others / f_hz[at] - 1.0) > ALONE))
