"""Straight beams of elements with rotations for the tests of imported bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fe_bodies import load_body
from numpy.typing import NDArray
from scipy import sparse

from flexarm_model.fe_import.hexahedra import Solid
from flexarm_model.manipulator.imported_body import ImportedBody

Array = NDArray[np.float64]
LENGTH, THICK, HIGH = 0.3, 0.004, 0.03  # of the strip [m]: it bends along y easily, along z hardly
RIGID = {name: {"set": f"{name}.txt", "kind": "rigid"} for name in ("root", "end")}
E, G, RHO = 70e9, 26.3e9, 2700.0  # Pa, Pa, kg/m^3


def bar_stiffness(h: float, axial: float, torsion: float, bend_y: float, bend_z: float) -> Array:
    """Return the stiffness of a bar of length h along x from EA, GJ, EI about z and EI about y, (12, 12)."""
    K = np.zeros((12, 12))
    for index, stiffness in (((0, 6), axial / h), ((3, 9), torsion / h)):
        K[np.ix_(index, index)] += stiffness * np.array([[1, -1], [-1, 1]])
    for index, sign, bending in (((1, 5, 7, 11), 1.0, bend_y), ((2, 4, 8, 10), -1.0, bend_z)):
        S = np.diag([1.0, sign, 1.0, sign])
        bend = np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
             [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
        )  # fmt: skip
        K[np.ix_(index, index)] += bending / h**3 * S @ bend @ S
    return K


def strip(n: int, tip_mass: float = 0.15, spring: float = 0.0, turning: bool = True) -> Solid:
    """Return an aluminium strip along x of n elements, its mass at the nodes.

    Args:
        n: Number of elements.
        tip_mass: On its end [kg].
        spring: Of every displacement of its two ends to the ground [N/m].
        turning: Whether its nodes have rotary inertia.
    """
    h, area = LENGTH / n, THICK * HIGH
    I_z, I_y = HIGH * THICK**3 / 12, THICK * HIGH**3 / 12
    element = bar_stiffness(h, E * area, G * HIGH * THICK**3 / 3, E * I_z, E * I_y)
    K = sparse.lil_array((6 * n + 6, 6 * n + 6))
    for k in range(n):
        K[6 * k : 6 * k + 12, 6 * k : 6 * k + 12] += element
    ends = [0, 1, 2, 6 * n, 6 * n + 1, 6 * n + 2]
    K[ends, ends] = K[ends, ends].toarray().ravel() + spring
    share = np.ones(n + 1)
    share[[0, -1]] = 0.5
    density = np.array([area] * 3 + [I_y + I_z, I_y, I_z])
    M = RHO * h * np.outer(share, density * (1.0 if turning else [1, 1, 1, 0, 0, 0]))
    M[-1, :3] += tip_mass
    x = np.zeros((n + 1, 3))
    x[:, 0] = h * np.arange(n + 1)
    return Solid(x, sparse.diags_array(M.ravel()).tocsr(), K.tocsr())


def chain(lengths: Array, thickness: Array, high: float) -> Solid:
    """Return aluminium elements along x, each of a length and thickness along y and so high along z [m].

    Their mass is at the nodes.
    """
    n = lengths.size
    K, mass = sparse.lil_array((6 * n + 6, 6 * n + 6)), np.zeros((n + 1, 6))
    for k, (h, thick) in enumerate(zip(lengths, thickness, strict=True)):
        area, I_z, I_y = thick * high, high * thick**3 / 12, thick * high**3 / 12
        index = np.arange(6 * k, 6 * k + 12)
        element = bar_stiffness(h, E * area, G * (I_y + I_z), E * I_z, E * I_y)
        K[np.ix_(index, index)] = K[np.ix_(index, index)] + element
        mass[k : k + 2] += RHO * h / 2 * np.array([area, area, area, I_y + I_z, I_y, I_z])
    x = np.zeros((n + 1, 3))
    x[1:, 0] = np.cumsum(lengths)
    return Solid(x, sparse.diags_array(mass.ravel()).tocsr(), K.tocsr())


def load_strip(folder: Path, solid: Solid, **body: object) -> ImportedBody:
    """Write and load a strip with rigid interfaces at its first and last node."""
    return load_body(folder, solid, interfaces=RIGID, **body)
