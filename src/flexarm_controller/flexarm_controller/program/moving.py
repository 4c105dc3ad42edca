"""The program of a horizon in which models change: the same quadratic program, condensed anew in each cycle.

Within a segment of the horizon one model holds, so its states follow from the one it begins with by the
powers of one matrix, as in ``prediction``; where it begins, the state passes into the modes of its model::

    x_k = F_{k-s} x_s + H_{k-s} d + h_{k-s} + (torques since s)          s: start of the segment
    x_s <- change x_s                                                   eta_new = Phi_new' M Phi_old eta_old

Every instant has the equilibrium, the weights and the limited outputs of the model that holds there, the last
one also the cost-to-go. With one segment this is the program of ``problem``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.problem import SLACK_CURVATURE, Problem
from flexarm_controller.program.soft_outputs import SoftOutputs
from flexarm_controller.program.stage import Stage
from flexarm_controller.settings import MpcConfig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Segment:
    """A stretch of the horizon in which one model holds.

    Attributes:
        start: First instant of it [periods]; it ends where the next one begins.
        stage: What the program needs of the model.
        change: State in the modes of the model before -> state in its own, (n_x, n_x).
    """

    start: int
    stage: Stage
    change: Array


Spans = tuple[tuple[Segment, int, int], ...]  # with first and last instant


@dataclass(frozen=True)
class Condensed:
    """What the segments decide: everything but the vectors.

    Attributes:
        spans: The segments with the first and the last instant that each leads to from its start.
        P: Hessian, (n_z, n_z).
        A: Rows, (m, n_z).
        L: Roots of the weights times what is penalised, per torque among the unknowns, (n_e, n_v).
    """

    spans: Spans
    P: Array
    A: Array
    L: Array


class MovingProgram:
    """Assembles programs of the shape of a ``Problem``, in the same units and in the same order."""

    def __init__(self, problem: Problem, config: MpcConfig) -> None:
        """Keep what does not depend on the segments."""
        self._problem, self._price, self._N = problem, config.slack_price, config.horizon
        self._T = problem.T[:, : problem.n_v].reshape(self._N, -1, problem.n_v)  # N m
        self._steps = np.concatenate([self._T[:1], np.diff(self._T, axis=0)])
        self._ends = np.cumsum(config.blocks)
        self._starts = self._ends - np.array(config.blocks)
        self._n_s = len(problem.P) - problem.n_v

    def condense(self, segments: Sequence[Segment]) -> Condensed:
        """Return Hessian and rows; segments are in order, the first one starts at instant 0."""
        ends = [segment.start for segment in segments[1:]] + [self._N]
        spans = tuple((segment, segment.start, end) for segment, end in zip(segments, ends, strict=True))
        problem, n_v = self._problem, self._problem.n_v
        G = self._states(spans)
        L = self._penalised(spans, G)
        P = np.diag(np.append(np.zeros(n_v), np.full(self._n_s, SLACK_CURVATURE)))
        P[:n_v, :n_v] = problem.weight * (L.T @ L)
        A, soft = problem.rows.A.copy(), np.vstack([s.C @ G[k] for s, k in self._soft(spans)])
        for rows in problem.rows.sides:
            A[rows, :n_v] = soft
        return Condensed(spans, P, A, L)

    def vectors(self, condensed: Condensed, p_now: Array, samples: Array) -> tuple[Array, Array, Array]:
        """Return ``(q, l, u)``.

        Args:
            condensed: Of the segments.
            p_now: What is known but the reference, (n_now,); the state in the first one's modes.
            samples: Reference [theta_r; theta_r'; theta_r''] at instants 0 ... N, (N + 1, 3 n_u).
        """
        problem, spans = self._problem, condensed.spans
        free = self._drift(spans, p_now[problem.known.x], p_now[problem.known.d])
        sags = self._sags(spans, p_now[problem.known.s])
        e_0 = self._errors(spans, free, p_now, samples, sags)
        q = np.append(problem.weight * (e_0 @ condensed.L), np.full(self._n_s, self._price))
        rows = problem.rows
        upper, lower = rows.sides
        shift = rows.b_now @ p_now
        l, u = rows.l + shift, rows.u + shift  # noqa: E741
        soft = self._soft(spans)
        y = np.concatenate([s.C @ (free[k] + sags[k]) + s.y_0 for s, k in soft])
        u[upper] = np.concatenate([s.high for s, _ in soft]) - y
        l[lower] = np.concatenate([s.low for s, _ in soft]) - y
        return q, l, u

    def _states(self, spans: Spans) -> Array:
        """Return the states per unknown, (N + 1, n_x, n_v); in the new modes where models change."""
        n_x, n_u = spans[0][0].stage.system.B.shape
        G = np.zeros((self._N + 1, n_x, self._problem.n_v))
        for segment, start, end in spans:
            G[start] = segment.change @ G[start]
            inside, p = slice(start + 1, end + 1), segment.stage.prediction
            past = slice(0, int(np.searchsorted(self._starts, start)) * n_u)  # chosen before the segment
            F = p.F[: (end - start) * n_x]
            G[inside, :, past] = (F @ G[start, :, past]).reshape(end - start, n_x, past.stop)
            acting, torques = self._acting(p.H, start, end)
            G[inside, :, acting] += torques * self._problem.effort[acting]
        return G

    def _acting(self, per_torque: Array, start: int, end: int) -> tuple[slice, Array]:
        """Return which unknowns act within a span and what they do after each of its periods.

        Args:
            per_torque: State after a torque of so many periods, H of the model, (N n_x, n_u).
            start: First instant.
            end: Last instant.
        """
        count, n_u = end - start, per_torque.shape[1]
        n_x = len(per_torque) // self._N
        H = np.concatenate([np.zeros((1, n_x, n_u)), per_torque.reshape(self._N, n_x, n_u)[:count]])
        first = int(np.searchsorted(self._ends, start, "right"))
        blocks = slice(first, int(np.searchsorted(self._starts, end)))
        steps = np.arange(1, count + 1)[:, None]
        since, until = (
            np.maximum(steps - np.maximum(edge[blocks] - start, 0), 0) for edge in (self._starts, self._ends)
        )  # a torque that is held is one that starts, less the same from its end on
        acting = slice(blocks.start * n_u, blocks.stop * n_u)
        width = acting.stop - acting.start
        return acting, (H[since] - H[until]).swapaxes(1, 2).reshape(count, n_x, width)

    def _drift(self, spans: Spans, x: Array, d: Array) -> Array:
        """Return the states without torques, (N + 1, n_x); in the new modes where models change."""
        free = np.zeros((self._N + 1, x.size))
        free[0] = x
        for segment, start, end in spans:
            free[start] = segment.change @ free[start]
            count, p = end - start, segment.stage.prediction
            inside = slice(0, count * x.size)
            drift = p.F[inside] @ free[start] + p.H[inside] @ d + p.h[inside]
            free[start + 1 : end + 1] = drift.reshape(count, x.size)
        return free

    def _sags(self, spans: Spans, sag: Array) -> Array:
        """Return the static deflection as a state at every instant, in the modes that hold, (N + 1, n_x)."""
        n_x, n_u = spans[0][0].stage.system.B.shape
        x, sags = np.zeros(n_x), np.zeros((self._N + 1, n_x))
        x[n_u : n_x // 2] = sag
        for segment, start, _ in spans:
            x = segment.change @ x
            sags[start:] = x
        return sags

    def _penalised(self, spans: Spans, G: Array) -> Array:
        """Return the roots of the weights times what is penalised, per unknown, (n_e, n_v)."""
        parts = []
        for segment, start, end in spans:
            cost, states = segment.stage.cost, G[max(start, 1) : end]
            parts += [np.sqrt(np.diag(cost.Q))[:, None] * states]
            parts += [np.sqrt(cost.tip_weight)[:, None] * (cost.tip @ states)]
            parts += [np.sqrt(np.diag(cost.R))[:, None] * self._T[start:end]]
            parts += [np.sqrt(np.diag(cost.S))[:, None] * self._steps[start:end]]
        parts.append(spans[-1][0].stage.terminal_root @ np.vstack([G[-1], self._T[-1]]))
        return np.vstack([part.reshape(-1, G.shape[2]) for part in parts])

    def _errors(self, spans: Spans, free: Array, p_now: Array, samples: Array, sags: Array) -> Array:
        """Return the same at no torque, (n_e,), in the same order."""
        d, before = p_now[self._problem.known.d], p_now[self._problem.known.u_before]
        first = np.zeros((self._N, d.size))
        first[0] = -before
        parts = []
        for segment, start, end in spans:
            cost, rest, target = segment.stage.cost, segment.stage.rest, samples[start : end + 1].copy()
            target[:, : d.size] += segment.stage.shift @ sags[start, d.size : sags.shape[1] // 2]
            k, inner = slice(start, end), slice(max(start, 1), end)
            r, states = target[inner.start - start : end - start], free[inner] - rest.x_0
            bent = states + sags[inner] - samples[inner] @ rest.X_rest.T
            parts += [np.sqrt(np.diag(cost.Q)) * (states - r @ rest.X.T)]
            parts += [np.sqrt(cost.tip_weight) * (bent @ cost.tip.T)]
            parts += [np.sqrt(np.diag(cost.R)) * (d - rest.u_0 - target[: end - start] @ rest.U.T)]
            parts += [np.sqrt(np.diag(cost.S)) * first[k]]
        dx = free[-1] - rest.X @ target[-1] - rest.x_0
        du = d - rest.U @ target[-1] - rest.u_0
        parts.append(spans[-1][0].stage.terminal_root @ np.concatenate([dx, du]))
        return np.concatenate([part.ravel() for part in parts])

    def _soft(self, spans: Spans) -> list[tuple[SoftOutputs, int]]:
        """Return the limited outputs of every instant at which a block ends, with that instant."""
        holds = np.searchsorted([start for _, start, _ in spans], self._ends, side="right") - 1
        return [(spans[i][0].stage.soft, int(k)) for i, k in zip(holds, self._ends, strict=True)]
