"""Description of bodies that come from another program: as sparse matrices, or reduced already."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

INTERFACE_KINDS = ("rigid", "averaging")


@dataclass(frozen=True)
class MatrixFile:
    """A file that holds a sparse matrix; ``variable`` names it in a MATLAB file of several."""

    path: Path
    variable: str = ""


@dataclass(frozen=True)
class FileUnits:
    """Units of the files in SI: length [m], mass [kg], time [s]."""

    length: float
    mass: float
    time: float


@dataclass(frozen=True)
class NodeSet:
    """Finite-element nodes that an interface node stands for.

    Attributes:
        kind: "rigid" (they move with it, RBE2) or "averaging" (it moves with their mean, RBE3).
        index: Their rows in the coordinates, (k,).
        weight: Weights of the mean, (k,).
    """

    kind: str
    index: NDArray[np.intp]
    weight: Array


@dataclass(frozen=True)
class ImportedReduction:
    """How the body becomes a superelement; its frame is the interface node "root".

    Attributes:
        method: "craig_bampton" or "guyan".
        modes: Number of modes kept in the end; 0 when ``f_max`` says it.
        f_max: All static and the fixed-interface modes up to here are kept [Hz]; 0 when ``modes`` says it.
        retain: Further nodes kept as interfaces, beside those that joints use.
        spare: Modes kept beyond ``modes``, as far as the body has them.
    """

    method: str
    modes: int
    f_max: float
    retain: tuple[str, ...] = ()
    spare: int = 0


@dataclass(frozen=True)
class ImportedBody:
    """A body given by sparse matrices over the displacements of finite-element nodes.

    Attributes:
        name: Name of the body.
        mass, stiffness: Files of M and K.
        damping: File of the viscous D, or None.
        units: Of the files.
        orientation: Axes of the files in the body frame, (3, 3).
        x: Coordinates of the finite-element nodes, in the order of the matrices, body frame [m], (k, 3).
        sets: What every interface node stands for.
        nodes: Position of every interface node in the body frame [m], (3,) each; "root" is the origin.
        damping_ratio: Of every mode of the body, where no matrix is given [1].
        reduction: How it is reduced.
        digest: Hash of the files' content.
        stiffness_scale: Factor on K and D, for plants that differ from their model [1].
        mass_scale: Factor on M, likewise [1].
        damping_scale: Factor on the viscous D, likewise [1].
        damping_time: Damping over stiffness [s], in addition to the ratio.
        damping_rate: Damping over mass [1/s] of every mode that strains this body alone, in addition.
        rows: Row of the files' matrices, from 0, of every displacement node by node, (3 k,) or (6 k,); None
            where they stand so.
        labels: Of the finite-element nodes in their file, (k,); None where they count from 1.
    """

    name: str
    mass: MatrixFile
    stiffness: MatrixFile
    damping: MatrixFile | None
    units: FileUnits
    orientation: Array
    x: Array
    sets: dict[str, NodeSet]
    nodes: dict[str, Array]
    damping_ratio: float
    reduction: ImportedReduction
    digest: str
    stiffness_scale: float = 1.0
    mass_scale: float = 1.0
    damping_scale: float = 1.0
    damping_time: float = 0.0
    damping_rate: float = 0.0
    rows: NDArray[np.intp] | None = None
    labels: NDArray[np.intp] | None = None

    @property
    def taken_along(self) -> NDArray[np.intp]:
        """Finite-element nodes that rigid interfaces move, by their rows in the coordinates, (m,)."""
        rigid = [nodes.index for nodes in self.sets.values() if nodes.kind == "rigid"]
        return np.concatenate([np.zeros(0, dtype=np.intp), *rigid])


@dataclass(frozen=True)
class SuperelementBody:
    """A body that is reduced already: a file of standard input data.

    Attributes:
        name: Name of the body.
        path: File.
        nodes: Position of every node in the body frame [m], (3,) each.
        strain: Its strain shapes as in ``NodeShape``, (3, n) each; NaN where the file knows none.
        digest: Hash of the file's content.
        stiffness_scale: Factor on stiffness and viscous damping, for plants that differ from their model [1].
        mass_scale: Factor on all masses, likewise [1].
        damping_scale: Factor on all damping, likewise [1].
    """

    name: str
    path: Path
    nodes: dict[str, Array]
    strain: dict[str, Array]
    digest: str
    stiffness_scale: float = 1.0
    mass_scale: float = 1.0
    damping_scale: float = 1.0
