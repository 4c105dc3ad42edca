"""Loops of the segment tree: constraint rows of its closures, closing them, and the motions they leave.

A closure makes two frames one: the end of its axes, on the parent's side, and the child's node. With both
positions p, rotations R and velocities in world axes, six rows per closure::

    c = [p_end - p_node; R_node log(R_node' R_end)]                [m, rad]
    c' = G v          c'' = G a + g(q, v)                          where c = 0

Rows that repeat others (out of the plane of a planar loop) go by the rank of G at home. The free axes are
those with neither motor nor spring: closing moves them alone. The columns G_f of those in loops must be
independent; where they are not, a loop moves with motors and springs held still: the pose is singular.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]

TOLERANCE = 1e-11  # of an open row [m or rad]
MAX_ITERATIONS = 60
STEP = 1e-5  # of a coordinate for central differences [m, rad or 1]
LONGEST_STEP = 0.3  # of an axis in one iteration [rad or m]: far steps change the branch
STRIDE = 0.1  # of the motors from one closed pose to the next [rad or m]
RANK_TOLERANCE = 1e-9  # of singular values, relative to the largest
SINGULAR = 1e-4  # smallest singular value of G_f, rows and columns scaled: 0.006 deg from collinear links


class SegmentLoops:
    """The constraint rows of a Pinocchio model with loops."""

    def __init__(self, model: pin.Model, data: pin.Data, ends: list[tuple[int, int]]) -> None:
        """Keep what the rows are made of.

        Args:
            model: Complete model.
            data: Its work space, written by every call.
            ends: Frames (end of the closure's axes, node) of every closure.
        """
        self._model, self._data, self._ends = model, data, ends
        self.n_rows = 6 * len(ends)

    def residual(self, q: Array) -> Array:
        """Return how far the loops are open, six rows per closure [m, rad], (n_rows,)."""
        pin.framesForwardKinematics(self._model, self._data, q)
        rows = [np.zeros(0)]
        for ends in self._ends:
            end, node = (self._data.oMf[frame] for frame in ends)
            turn = pin.log3(node.rotation.T @ end.rotation)
            rows += [end.translation - node.translation, node.rotation @ turn]
        return np.concatenate(rows)

    def jacobian(self, q: Array) -> Array:
        """Return G, (n_rows, n_q)."""
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        rows = [np.zeros((0, self._model.nv))]
        for ends in self._ends:
            end, node = (pin.getFrameJacobian(self._model, self._data, f, _WORLD_AXES) for f in ends)
            rows.append(end - node)
        return np.concatenate(rows)

    def drift(self, q: Array, v: Array) -> Array:
        """Return g, the rows' second derivative at constant rates, (n_rows,)."""
        pin.forwardKinematics(self._model, self._data, q, v, 0 * v)
        pin.updateFramePlacements(self._model, self._data)
        rows = [np.zeros(0)]
        for ends in self._ends:
            end, node = (
                pin.getFrameClassicalAcceleration(self._model, self._data, frame, _WORLD_AXES).vector
                for frame in ends
            )
            rows.append(end - node)
        return np.concatenate(rows)

    def stiffness(self, q: Array, force: Array) -> Array:
        """Return d(G' force)/dq by central differences at a force of the rows, (n_q, n_q)."""
        columns = []
        for e in np.eye(q.size) * STEP:
            columns.append((self.jacobian(q + e) - self.jacobian(q - e)).T @ force / (2 * STEP))
        return np.array(columns).T

    def close(self, start: Array, free: Array, what: str) -> Array:
        """Return q with the loops closed, moving the free axes alone (Gauss-Newton), (n_q,).

        Args:
            start: Where the iteration starts, (n_q,).
            free: Axes with neither motor nor spring.
            what: Manipulator and pose, for messages.

        Raises:
            ClosureError: The loops stay open, or a loop moves with motors and springs held still.
        """
        q = np.array(start)
        for _ in range(MAX_ITERATIONS):
            c = self.residual(q)
            if abs(c).max(initial=0.0) <= TOLERANCE:
                break
            step = np.linalg.lstsq(self.jacobian(q)[:, free], -c, rcond=RANK_TOLERANCE)[0]
            q[free] += step * min(1.0, LONGEST_STEP / max(abs(step).max(initial=0.0), TOLERANCE))
        sigma = self.singular_values(q, free)
        rank, smallest = int(np.sum(sigma > SINGULAR)), sigma.min(initial=np.inf)
        state = f"rank {rank} of {sigma.size} free axes, smallest singular value {smallest:.2g}"
        if abs(self.residual(q)).max(initial=0.0) > TOLERANCE:
            left = abs(self.residual(q)).max()
            raise ClosureError(f"{what}: a loop cannot be closed; {left:.3g} m or rad stay open ({state})")
        if rank < sigma.size:
            raise ClosureError(f"{what} is singular: a loop moves with the motors held still ({state})")
        return q

    def singular_values(self, q: Array, free: Array) -> Array:
        """Return those of G_f, descending, (k,), lengths in units of the loops, columns of length one."""
        G = self.jacobian(q)[:, free]
        position = np.arange(self.n_rows) % 6 < 3
        turns = G[:, abs(G[~position]).max(axis=0, initial=0.0) > RANK_TOLERANCE]
        G[position] /= abs(turns[position]).max(initial=0.0) or 1.0
        norm = np.linalg.norm(G, axis=0)
        in_loops = norm > RANK_TOLERANCE
        return np.asarray(np.linalg.svd(G[:, in_loops] / norm[in_loops], compute_uv=False))


_WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


def row_space(G: Array) -> Array:
    """Return combinations of rows without those that repeat others, orthonormal, (rank, n_rows)."""
    U, sigma, _ = np.linalg.svd(G, full_matrices=False)
    return np.asarray(U[:, sigma > RANK_TOLERANCE * sigma.max(initial=0.0)].T)


def null_space(G: Array) -> Array:
    """Return the motions that keep the rows, orthonormal, (n, n - rank)."""
    n = G.shape[1]
    if G.shape[0] == 0:
        return np.eye(n)
    _, sigma, V_t = np.linalg.svd(G)
    return np.asarray(V_t[np.sum(sigma > RANK_TOLERANCE * sigma.max(initial=0.0)) :].T)
