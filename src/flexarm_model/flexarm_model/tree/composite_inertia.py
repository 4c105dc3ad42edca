"""The mass matrix from composite inertias, in CasADi: wrenches and rates about one point, the world's origin.

About a common point a wrench is the same for every frame that passes it on, so a column of M is one product
``I S`` and a dot product per row [Featherstone2008]. With S the rates ``[w; u]`` that a coordinate gives
all that stands on its frame, I the inertia of that, and P what elastic accelerations ask of their body::

    F_k = sum_i I_i S_ik + P_k        M_lk = S_l' F_k        (k beyond l)

A body is ``(m, c, I)``: mass, first moment and inertia about the origin.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import casadi as ca

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.tree.coordinates import Coordinates
from flexarm_model.tree.elastic_forces import inertia_forces
from flexarm_model.tree.frame_graph import Frame, FrameGraph
from flexarm_model.tree.frames import Motion

Columns: TypeAlias = dict[int, ca.SX]  # 6 rows, by coordinate
WORTHWHILE = 60  # coordinates; at 84 it saves three fifths of the operations, at 42 none


@dataclass(frozen=True)
class _Inertia:
    """Mass, first moment (3,) and inertia (3, 3) about the world's origin."""

    m: ca.SX
    c: ca.SX
    rotary: ca.SX

    def __add__(self, other: _Inertia) -> _Inertia:
        return _Inertia(self.m + other.m, self.c + other.c, self.rotary + other.rotary)

    def times(self, rates: ca.SX) -> ca.SX:
        """Return the wrench [moment; force] that accelerations [w; u] take, (6,)."""
        w, u = rates[:3], rates[3:]
        return ca.vertcat(self.rotary @ w + ca.cross(self.c, u), self.m * u + ca.cross(w, self.c))


@dataclass(frozen=True)
class _Body:
    """A body: its inertia, wrenches of its elastic accelerations, and its own mass (n, n)."""

    inertia: _Inertia
    wrenches: Columns
    own: ca.SX


def composite_mass(
    graph: FrameGraph,
    bodies: Mapping[str, Superelement],
    at: Coordinates,
    motions: dict[int, Motion],
    symbols: tuple[ca.SX, ca.SX],
) -> ca.SX:
    """Return the mass matrix, (n_q, n_q).

    Args:
        graph: The frames.
        bodies: Superelements by name.
        at: The coordinates.
        motions: Motion of every frame.
        symbols: q, and the accelerations.
    """
    sweep = _Sweep(at.n)
    for i, axis in enumerate(at.axes.values()):
        sweep.M.add(i, i, ca.SX(axis.rotor_inertia))
    for name, body in bodies.items():
        frame = graph.body_frames[name]
        sweep.add_body(frame, _at_origin(body, motions[frame], symbols, at.elastic[name]))
    for i in reversed(range(len(graph.frames))):
        if i in sweep.inertia:  # others carry a sensor and no mass
            sweep.add_frame(i, graph.frames[i].parent, _rates(graph.frames[i], motions, i))
    sweep.rows.fill(sweep.M)
    return sweep.M.matrix()


class _Sweep:
    """What is known of the frames from the outermost inwards.

    Attributes:
        inertia: Of all that stands on a frame.
        M: The mass matrix, without ``rows``.
        rows: What coordinates feel of those beyond them.
    """

    def __init__(self, n: int) -> None:
        self.inertia: dict[int, _Inertia] = {}
        self.M, self.rows = _Entries(n), _Rows()
        self._beyond: dict[int, Columns] = {}

    def add_body(self, frame: int, body: _Body) -> None:
        """Put a body on its frame."""
        self.inertia[frame], self._beyond[frame] = body.inertia, body.wrenches
        first = min(body.wrenches, default=0)
        for i in range(body.own.size1()):
            for j in range(i + 1):
                self.M.add(first + i, first + j, body.own[i, j])

    def add_frame(self, i: int, parent: int, rates: Columns) -> None:
        """Let the coordinates of a frame's step feel all that stands on it, and hand that to its parent."""
        inertia, beyond = self.inertia[i], self._beyond.setdefault(i, {})
        wrenches = {k: inertia.times(rate) for k, rate in rates.items()}
        for l, rate in rates.items():  # noqa: E741
            self.rows.add(l, rate, beyond)
            for k, wrench in wrenches.items():
                if k <= l:
                    self.M.add(l, k, ca.dot(rate, wrench))
        self.inertia[parent] = self.inertia[parent] + inertia if parent in self.inertia else inertia
        _merge(beyond, wrenches)
        _merge(self._beyond.setdefault(parent, {}), beyond)


class _Entries:
    """Entries of a symmetric matrix."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._entries: dict[tuple[int, int], ca.SX] = {}

    def add(self, row: int, column: int, value: ca.SX) -> None:
        """Add to an entry and to its mirror image; on the diagonal once."""
        if not value.is_zero():
            at = (max(row, column), min(row, column))
            self._entries[at] = self._entries[at] + value if at in self._entries else value

    def matrix(self) -> ca.SX:
        """Return the matrix, (n, n)."""
        places = sorted(self._entries, key=lambda place: place[::-1])
        lower = ca.Sparsity.triplet(self._n, self._n, [i for i, _ in places], [j for _, j in places])
        return ca.tril2symm(ca.SX(lower, ca.vertcat(*(self._entries[place] for place in places))))


class _Rows:
    """Rows ``S_l' F_k``; where several frames move l and see the same F_k, their S are added first."""

    def __init__(self) -> None:
        self._parts: dict[int, dict[int, list[tuple[tuple[int, ...], ca.SX]]]] = {}
        self._rates: dict[int, list[ca.SX]] = {}

    def add(self, coordinate: int, rate: ca.SX, wrenches: Columns) -> None:
        """Add the dot products of a rate with all wrenches."""
        rates = self._rates.setdefault(coordinate, [])
        rates.append(rate)
        row = self._parts.setdefault(coordinate, {})
        for k, wrench in wrenches.items():
            parts = row.setdefault(k, [])
            if parts and parts[-1][1] is wrench:
                parts[-1] = ((*parts[-1][0], len(rates) - 1), wrench)
            else:
                parts.append(((len(rates) - 1,), wrench))

    def fill(self, M: _Entries) -> None:
        """Add the rows, and the same as columns."""
        for l, row in self._parts.items():  # noqa: E741
            sums: dict[tuple[int, ...], ca.SX] = {}
            for k, parts in row.items():
                for which, wrench in parts:
                    if which not in sums:
                        sums[which] = _sum([self._rates[l][i] for i in which])
                    value = ca.dot(sums[which], wrench)
                    M.add(l, k, 2 * value if k == l else value)


def _rates(frame: Frame, motions: dict[int, Motion], i: int) -> Columns:
    """Return what the coordinates of a frame's step do to all that stands on it."""
    R, step, p = motions[frame.parent].R, frame.step, motions[i].p
    columns = sorted({*step.J_p.sparsity().get_col(), *step.J_w.sparsity().get_col()})
    rates = {}
    for k in columns:
        w = R @ step.J_w[:, k]
        rates[k] = ca.vertcat(w, R @ step.J_p[:, k] + ca.cross(p, w))
    return rates


def _at_origin(body: Superelement, motion: Motion, symbols: tuple[ca.SX, ca.SX], index: range) -> _Body:
    """Return a body as seen from the world's origin."""
    q, a = symbols
    zero, dw, du = ca.SX(3, 1), ca.SX.sym("dw", 3), ca.SX.sym("du", 3)
    local = Motion(p=zero, R=ca.SX.eye(3), w=zero, dw=dw, u=zero, a=du)
    force, moment, generalised = inertia_forces(body, local, q, ca.SX(q.numel(), 1), a, index)
    own = slice(index.start, index.stop)
    per = ca.jacobian(ca.vertcat(moment, force, generalised[own]), ca.vertcat(dw, du, a[own]))
    R, p = motion.R, motion.p
    h = R @ ca.vertcat(-per[5, 1], -per[3, 2], -per[4, 0])  # d force / d dw is minus the skew first moment
    P, H = ca.skew(p), ca.skew(h)
    rotary = R @ per[:3, :3] @ R.T - (P @ H + H @ P) - body.mass * (P @ P)
    wrenches = {}
    for j, k in enumerate(index):
        f = R @ per[3:6, 6 + j]
        wrenches[k] = ca.vertcat(R @ per[:3, 6 + j] + ca.cross(p, f), f)
    return _Body(_Inertia(ca.SX(body.mass), body.mass * p + h, rotary), wrenches, per[6:, 6:])


def _sum(vectors: list[ca.SX]) -> ca.SX:
    total = vectors[0]
    for vector in vectors[1:]:
        total = total + vector
    return total


def _merge(into: Columns, columns: Columns) -> None:
    for k, column in columns.items():
        into[k] = into[k] + column if k in into else column
