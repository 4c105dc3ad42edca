"""A truth that obeys the filter's own model to the letter: noise drawn from what the filter assumes.

One step of the joint normal distribution that the filter conditions on::

    x+ = A x + B u + w      y = C x+ + D u + v      Cov[w; v] = [Q, M; M', R + D_w F D_w']

``M`` is the correlation by which accelerometers feel the process noise. Cameras see the pose of the state,
turned and shifted by their own noise. With ``noise=False`` the run is exact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.state.process import Transition
from flexarm_estimator.steps.stack import Stack, stack_rows
from flexarm_estimator.tool.seen_pose import seen_pose

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drawn:
    """A run of the truth.

    Attributes:
        x: State at every instant, (k, n_x).
        samples: Of every instant.
    """

    x: Array
    samples: tuple[tuple[Measurement, ...], ...]


class DrawnTruth:
    """Draws runs of one model."""

    def __init__(self, parts: Parts, camera_every: Mapping[str, int]) -> None:
        """Bind the parts of an estimator.

        Args:
            parts: Process, sensors and tip.
            camera_every: Instants between two frames, by camera.
        """
        self._parts, self._camera_every = parts, camera_every
        self._stack: Stack = stack_rows(list(parts.sensors.rows.values()), parts.process.force_cov)

    def draw(
        self, t: Array, tau: Array, start: Array, first: float, rng: np.random.Generator | None
    ) -> Drawn:
        """Return a run.

        Args:
            t: Instants [s], (k,).
            tau: Torque that acts until each of them, (k, n_theta).
            start: State before the first instant, (n_x,).
            first: Time between the start and the first instant [s].
            rng: None for a run without any noise.
        """
        x, states, samples = start, [], []
        transition = self._parts.process.step(first)
        root = self._root(transition)
        for i, now in enumerate(t):
            if i:
                following = self._parts.process.step(now - t[i - 1])
                if following is not transition:
                    transition, root = following, self._root(following)
            noise = np.zeros(root.shape[0]) if rng is None else root @ rng.standard_normal(root.shape[1])
            u = np.append(tau[i], 1.0)
            local = transition.at(x, u)  # exact at x, also where something of the model is learned
            x = local.A @ x + local.B @ u + noise[: x.size]
            states.append(x)
            samples.append(
                (*self._rows(x, u, noise[x.size :], float(now)), *self._frames(x, i, float(now), rng))
            )
        return Drawn(np.array(states), tuple(samples))

    def _root(self, transition: Transition) -> Array:
        """Return a root of the covariance of [w; v]."""
        M = self._stack.cross(transition)
        return root_of(np.block([[transition.Q, M], [M.T, self._stack.R_total]]))

    def _rows(self, x: Array, u: Array, v: Array, t: float) -> list[Measurement]:
        local = self._stack.at(x, u)
        y = local.C @ x + local.D @ u + v
        pairs = zip(self._stack.names, self._stack.spans, strict=True)
        return [Measurement(name, t, y[span]) for name, span in pairs]

    def _frames(self, x: Array, i: int, t: float, rng: np.random.Generator | None) -> list[Measurement]:
        frames = []
        for name, camera in self._parts.sensors.poses.items():
            if i % self._camera_every[name]:
                continue
            sigma = np.sqrt(camera.R.diagonal())
            noise = np.zeros(sigma.size) if rng is None else sigma * rng.standard_normal(sigma.size)
            y = seen_pose(self._parts.tip.pose(x), camera.channels, noise)
            frames.append(Measurement(name, t, y))
        return frames


def root_of(covariance: Array) -> Array:
    """Return a root of a covariance (n, n), which may be singular.

    The symmetric one: the signs of eigenvectors differ from processor to processor, and with them draws.
    """
    scale = np.sqrt(covariance.diagonal())
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return np.asarray(scale[:, None] * root)
