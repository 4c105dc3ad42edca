"""Seed 000 as a plane frame of beam elements: the direct finite-element model, motors locked.

Every link is a chain of Euler-Bernoulli elements with consistent mass. Hinges share displacements: an elbow
has X, Y and a rotation for each link, a platform hinge moves with the platform ``[x, y, alpha]`` and has the
link's rotation. Rigid half-bodies of length e, n the link's normal::

    link 1, tip     v = n'B - e theta_1         link 2, start   v = n'B + e theta_2
    link 1, root    u = v = theta = 0           link 2, end     v = n'C - e theta_c

so that n elements per link give 3 + 3 (5 + 6 (n - 1)) displacements. Nothing of the product's own beams,
joints or loop closure is used here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_bringup.reproduce.seed_000_rig import Leg, Rig, Strip, place_legs

Array = NDArray[np.float64]

ELEMENTS = 8  # per link, of the golden table


@dataclass(frozen=True)
class Frame:
    """The frame at a pose.

    Attributes:
        M, K: Mass and stiffness, (n, n).
        nodes: Displacement rows [along, across, turn] of the strip nodes, by (leg, link), (n_nodes, 3, n).
        hinges: Rows across the second link at its platform hinge, by leg, (n,) each.
    """

    M: Array
    K: Array
    nodes: dict[tuple[int, int], Array]
    hinges: list[Array]

    def modes(self) -> tuple[Array, Array]:
        """Return all frequencies [Hz] (n,) and mass-normalised shapes (n, n)."""
        value, shapes = eigh(self.K, self.M)
        return np.sqrt(np.maximum(value, 0.0)) / (2 * np.pi), shapes

    def frequencies(self, count: int) -> Array:
        """Return the slowest frequencies [Hz], (count,)."""
        value = eigh(self.K, self.M, eigvals_only=True, subset_by_index=(0, count - 1))
        return np.asarray(np.sqrt(value) / (2 * np.pi))

    def middle(self, leg: int, link: int) -> Array:
        """Return the row across a link at its middle node, (n,)."""
        rows = self.nodes[leg, link]
        return np.asarray(rows[(len(rows) - 1) // 2, 1])


def build_frame(rig: Rig, pose: tuple[float, float, float], elements: int = ELEMENTS) -> Frame:
    """Return the frame.

    Args:
        rig: The numbers.
        pose: x [m], y [m], alpha [rad].
        elements: Per link, at least 1.
    """
    legs = place_legs(rig, pose)
    inner = 3 * (elements - 1)
    n = 3 + len(legs) * (5 + 2 * inner)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    M[[0, 1, 2], [0, 1, 2]] = rig.platform_mass, rig.platform_mass, rig.platform_inertia
    frame = Frame(M, K, {}, [])
    for i, leg in enumerate(legs):
        at = 3 + i * (5 + 2 * inner)
        M[[at, at + 1], [at, at + 1]] += rig.elbow_mass
        ends = _end_rows(rig, leg, np.array(pose[:2]), np.eye(n), at)
        for link, strip in enumerate((rig.first, rig.second), start=1):
            start = at + 5 + (link - 1) * inner
            between = np.eye(n)[start : start + inner].reshape(-1, 3, n)
            rows = np.concatenate([ends[2 * link - 2][None], between, ends[2 * link - 1][None]])
            frame.nodes[i, link] = rows
            _add_strip(M, K, strip, rows)
        across = ends[3][1] + rig.half_body * ends[3][2]
        frame.hinges.append(across)
    return frame


def _end_rows(rig: Rig, leg: Leg, centre: Array, one: Array, at: int) -> list[Array]:
    """Return [along, across, turn] at root and tip of link 1, start and end of link 2, (3, n) each."""
    e = rig.half_body
    (along_1, across_1), (along_2, across_2) = (_axes(angle) for angle in leg.angles)
    rho = leg.hinge - centre
    elbow = one[[at, at + 1]]  # (2, n)
    hinge = np.array([one[0] - rho[1] * one[2], one[1] + rho[0] * one[2]])
    turn_1, turn_2, turn_c = one[at + 2], one[at + 3], one[at + 4]
    return [
        np.zeros((3, one.shape[0])),
        np.array([along_1 @ elbow, across_1 @ elbow - e * turn_1, turn_1]),
        np.array([along_2 @ elbow, across_2 @ elbow + e * turn_2, turn_2]),
        np.array([along_2 @ hinge, across_2 @ hinge - e * turn_c, turn_c]),
    ]


def _axes(angle: float) -> tuple[Array, Array]:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c, s]), np.array([-s, c])


def _add_strip(M: Array, K: Array, strip: Strip, rows: Array) -> None:
    """Add the elements between the nodes whose displacements are ``rows``, (n_nodes, 3, n)."""
    h = strip.length / (len(rows) - 1)
    mass, stiffness = element_matrices(strip, h)
    for first, second in zip(rows[:-1], rows[1:], strict=True):
        T = np.concatenate([first, second])  # (6, n)
        M += T.T @ mass @ T
        K += T.T @ stiffness @ T


def element_matrices(strip: Strip, h: float) -> tuple[Array, Array]:
    """Return consistent mass and stiffness of an element over [u v theta] of its ends, (6, 6) each."""
    axial, bending = [0, 3], [1, 2, 4, 5]
    mass, stiffness = np.zeros((6, 6)), np.zeros((6, 6))
    m = strip.density * strip.area * h
    mass[np.ix_(axial, axial)] = m / 6 * np.array([[2, 1], [1, 2]])
    stiffness[np.ix_(axial, axial)] = strip.E * strip.area / h * np.array([[1, -1], [-1, 1]])
    mass[np.ix_(bending, bending)] = (
        m
        / 420
        * np.array(
            [
                [156, 22 * h, 54, -13 * h],
                [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                [54, 13 * h, 156, -22 * h],
                [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
            ]
        )
    )
    stiffness[np.ix_(bending, bending)] = (
        strip.EI
        / h**3
        * np.array(
            [
                [12, 6 * h, -12, 6 * h],
                [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                [-12, -6 * h, 12, -6 * h],
                [6 * h, 2 * h**2, -6 * h, 4 * h**2],
            ]
        )
    )
    return mass, stiffness
