"""The least tip error that any filter can have while a sensor is silent (fault matrix rows 4, 9 and 17).

With the noises as given no filter beats the covariance of the Kalman filter [Anderson1979], whatever the
samples say; it needs none of them, and is computed here by itself, from the matrices of model and sensors::

    P- = A P A' + Q     S = C P- C' + C M + M' C' + R     K = (P- C' + M) S^-1     P = P- - K S K'

The camera counts as if its frames came at once. The axis is known by its encoder until it falls silent; from
then on a torque that nobody has told moves it unseen, and the frames are all there is.

  python -m flexarm_bringup.fault_drill.least_error single_link encoder
"""

from __future__ import annotations

import sys
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.stand import FAULT_END, FAULT_START, Stand
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.parts import Parts
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import Transition
from flexarm_estimator.steps.stack import Stack, stack_rows
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SETTLING = 10.0  # s after which a covariance has settled
SHARES = (1.0, 0.1, 0.01, 1e-3, 1e-4)  # of the torque noise of the settings


@dataclass(frozen=True)
class Outage:
    """The least RMS error of the tip's position before and while a sensor is silent [m]."""

    before: float
    during: float


class LeastError:
    """Covariance of the best filter of one arm at its home pose."""

    def __init__(self, stand: Stand, settings: EstimatorConfig) -> None:
        """Take model, sensors and noises."""
        config, tree = stand.arm.config, ReducedTree(stand.arm.config)
        model = linearize(tree)
        self._parts: Parts = Estimator(model, tree, config.sensors, settings).past[0]
        self._dt = 1.0 / config.rate_hz
        self._step: Transition = self._parts.process.step(self._dt)
        x = np.zeros(len(self._step.A))
        x[: model.n] = model.xi0
        self._tip = np.zeros((3, x.size))
        self._tip[:, : model.n] = self._parts.tip.locate(x)[1][:3]
        rates = {spec.name: spec.rate_hz for spec in config.sensors}
        self._poses = [
            (max(round(1.0 / (rates[name] * self._dt)), 1), pose.jacobian(x), pose.R)
            for name, pose in self._parts.sensors.poses.items()
        ]

    def outage(self, silent: Collection[str]) -> Outage:
        """Return the least error when some sensors fall silent while a fault lasts."""
        P = self._parts.process.P0
        for k in range(round(SETTLING / self._dt)):
            P = self.after(P, k, self._stack(()))
        before, during = self._variance(P), []
        for k in range(round((FAULT_END - FAULT_START) / self._dt)):
            P = self.after(P, k, self._stack(silent))
            during.append(self._variance(P))
        return Outage(float(np.sqrt(before)), float(np.sqrt(np.mean(during))))

    def after(self, P: Array, k: int, rows: Stack) -> Array:
        """Return the covariance one period later, with the rows and a frame, if due, of tick ``k``."""
        P = self._step.A @ P @ self._step.A.T + self._step.Q
        P = update(P, rows.C, rows.R_total, rows.cross(self._step))
        for every, H, R in self._poses:
            if k % every == 0:
                P = update(P, H, R, np.zeros(H.T.shape))
        return P

    def _stack(self, silent: Collection[str]) -> Stack:
        rows = [model for name, model in self._parts.sensors.rows.items() if name not in silent]
        return stack_rows(rows, self._parts.process.force_cov)

    def _variance(self, P: Array) -> float:
        return float(np.trace(self._tip @ P @ self._tip.T))


def update(P: Array, C: Array, R: Array, M: Array) -> Array:
    """Return the covariance after a sample.

    Args:
        P: Before it, (n_x, n_x).
        C: Rows, (m, n_x).
        R: Covariance of their noise, (m, m).
        M: Of the process noise in P with that of the rows, (n_x, m).
    """
    S = C @ P @ C.T + C @ M + M.T @ C.T + R
    cross = P @ C.T + M
    updated = P - cross @ np.linalg.solve(S, cross.T)
    return np.asarray((updated + updated.T) / 2)


def main(name: str = "single_link", kind: str = "encoder") -> dict[str, float]:
    """Print the least error without a kind of sensor for ever less torque that nobody has told.

    Returns:
        That error over the one before, by share of the noise of the settings.
    """
    stand, found = Stand(name), {}
    silent = [spec.name for spec in stand.of_kind(kind)]
    print(f"{name}: {kind} silent for {FAULT_END - FAULT_START:g} s, least RMS tip error of any filter")
    for share in SHARES:
        settings = quieter(stand.settings, share)
        outage = LeastError(stand, settings).outage(silent)
        found[f"{share:g}"] = outage.during / outage.before
        print(
            f"  torque unknown by {settings.disturbance_drift:.2g} rad/s^2 after 1 s, forces on modes by "
            f"{settings.modal_force:.2g} kg^0.5 m/s^2: {1e6 * outage.during:.0f} um instead of "
            f"{1e6 * outage.before:.1f} um, {outage.during / outage.before:.1f} times"
        )
    return found


def quieter(settings: EstimatorConfig, share: float) -> EstimatorConfig:
    """Return settings with a share of the noise of all forces and torques."""
    return replace(
        settings,
        acceleration_noise=share * settings.acceleration_noise,
        disturbance_drift=share * settings.disturbance_drift,
        frequency_error=share * settings.frequency_error,
        modal_force=share * settings.modal_force,
    )


if __name__ == "__main__":
    main(*sys.argv[1:3])
