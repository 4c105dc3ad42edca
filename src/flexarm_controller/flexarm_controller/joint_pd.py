"""Joint PD with feed-forward: what most arms run, and the baseline of every comparison.

Each axis is a damped spring about its reference, and the served model adds what a rigid arm in its place
needs: gravity and springs at the reference, friction, inertia; modes follow statically::

    tau = U r + u_0 + K_p (theta_r - theta) + K_d (theta_r' - theta')
    K_p = w^2 diag(M_tt)        K_d = 2 zeta w diag(M_tt)        w = bandwidth omega_1

``omega_1`` is the slowest mode with the axes locked: a joint loop well below it does not feel the modes, one
well above it lets them ring. ``w`` also stays below what the control period can follow, and is lowered until
the loop would bear twice the gains, with its delay and latency (a share of a period counts as a whole one)
and with the modes of the served model: a light motor on a heavy link would excite them. Where that leaves too
little against gravity, or against springs that push an axis away, only the axes that grow are lowered, and
where that leaves too little, too, all is tried again with less damping: it is what excites modes most.
Nothing is known here of the modes' state, of the unmodelled torque or of the future.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.joint_loop import GAIN_MARGIN, JointLoop
from flexarm_controller.program.delay import split_delay, torques_kept
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
FASTEST = 0.2  # of the joint loop [rad per control period]: about 60 degrees of phase are left with delay
LOWER = 0.8  # factor between two tries
TRIES = 40
SOFTER = (1.0, 0.7, 0.5, 0.35, 0.25)  # of the damping ratio, one after the other


class JointPd:
    """Feedback on the motor encoders, axis by axis, and feed-forward of the rigid arm.

    Attributes:
        wanted: Frequencies from which they were lowered [rad/s], (n_theta,).
        frequency: Undamped natural frequencies of the joint loops [rad/s], (n_theta,).
        K_p: Torque per position error, (n_theta,).
        K_d: Torque per velocity error, (n_theta,).
        damping_ratio: Of the joint loops, at most that of the settings [1].
    """

    def __init__(self, model: ReducedModel, config: ControllerConfig, mpc: MpcConfig) -> None:
        """Tune the loops by rule.

        Args:
            model: The served model.
            config: Bandwidth, damping ratio and period.
            mpc: Delay and latency between a state and the torque computed from it.
        """
        slowest = model.omega[0] if model.n_eta else np.inf
        self.wanted = np.full(model.n_theta, min(config.pd_bandwidth * slowest, FASTEST / config.period))
        loop = JointLoop(model, config.period, torques_kept(mpc, config.period))
        self._inertia = np.diag(model.M)[: model.n_theta]
        for share in (*SOFTER, 1.0):  # where none bears it, as hard as asked for: the margins tell
            self.damping_ratio = share * config.pd_damping
            if self._is_tuned(loop):
                break
        self._equilibrium = build_equilibrium(model)
        whole, share = split_delay(mpc, config.period)
        self._ahead = np.array([0.0, (whole + share) * config.period])

    def gains(self, frequency: Array) -> tuple[Array, Array]:
        """Return K_p and K_d of frequencies [rad/s], (n_theta,) each."""
        return frequency**2 * self._inertia, 2.0 * self.damping_ratio * frequency * self._inertia

    def _is_tuned(self, loop: JointLoop) -> bool:
        """Lower the frequencies with the damping ratio at hand; return whether the loop bears the gains."""
        self._tune(loop, lambda: np.ones(self.wanted.size, bool))
        if not loop.bears(self.K_p, self.K_d):
            self._tune(loop, lambda: np.arange(self.wanted.size) == self._culprit(loop))
        return loop.bears(self.K_p, self.K_d)

    def _tune(self, loop: JointLoop, to_lower: Callable[[], NDArray[np.bool_]]) -> None:
        """Lower axes from the frequencies that are wanted until the loop bears twice the gains."""
        self.frequency = self.wanted
        for _ in range(TRIES * self.wanted.size):
            self.K_p, self.K_d = self.gains(self.frequency)
            if loop.is_stable(GAIN_MARGIN * self.K_p, GAIN_MARGIN * self.K_d):
                break
            self.frequency = np.where(to_lower(), LOWER * self.frequency, self.frequency)

    def _culprit(self, loop: JointLoop) -> int:
        return loop.culprit(GAIN_MARGIN * self.K_p, GAIN_MARGIN * self.K_d)

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Array:
        """Return the torque that follows those already ``sent``, not yet limited, (n_u,).

        Args:
            state: State at its own instant; only the axes are looked at.
            reference: Reference of the axes.
            sent: Not needed.
        """
        theta, theta_dot, theta_ddot = reference.sample(state.t + self._ahead)
        r = np.concatenate([theta[1], theta_dot[1], theta_ddot[1]])
        forward = self._equilibrium.U @ r + self._equilibrium.u_0
        feedback = self.K_p * (theta[0] - state.theta) + self.K_d * (theta_dot[0] - state.theta_dot)
        return np.asarray(forward + feedback)
