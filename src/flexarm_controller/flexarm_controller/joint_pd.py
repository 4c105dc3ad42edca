"""Joint PD with feed-forward: what most arms run, and the baseline of every comparison.

Each axis is a damped spring about its reference, and the served model adds what a rigid arm in its place
needs: gravity and springs at the reference, friction, inertia; modes follow statically::

    tau = U r + u_0 + K_p (theta_r - theta) + K_d (theta_r' - theta')
    K_p = w^2 diag(M_tt)        K_d = 2 zeta w diag(M_tt)        w = bandwidth omega_1

``omega_1`` is the slowest mode with the axes locked: a joint loop well below it does not feel the modes, one
well above it lets them ring. ``w`` also stays below what the control period can follow, and is lowered until
the loop would bear twice the gains, with its delay and latency (a share of a period counts as a whole one)
and with the modes of the served model: a light motor on a heavy link would excite them. Nothing is known here
of the modes' state, of the unmodelled torque or of the future.
"""

from __future__ import annotations

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


class JointPd:
    """Feedback on the motor encoders, axis by axis, and feed-forward of the rigid arm.

    Attributes:
        frequency: Undamped natural frequency of the joint loops [rad/s].
        K_p: Torque per position error, (n_theta,).
        K_d: Torque per velocity error, (n_theta,).
    """

    def __init__(self, model: ReducedModel, config: ControllerConfig, mpc: MpcConfig) -> None:
        """Tune the loops by rule.

        Args:
            model: The served model.
            config: Bandwidth, damping ratio and period.
            mpc: Delay and latency between a state and the torque computed from it.
        """
        slowest = model.omega[0] if model.n_eta else np.inf
        frequency = float(min(config.pd_bandwidth * slowest, FASTEST / config.period))
        loop = JointLoop(model, config.period, torques_kept(mpc, config.period))
        for _ in range(TRIES):
            self._tune(model, frequency, config.pd_damping)
            if loop.is_stable(GAIN_MARGIN * self.K_p, GAIN_MARGIN * self.K_d):
                break
            frequency *= LOWER
        self._equilibrium = build_equilibrium(model)
        whole, share = split_delay(mpc, config.period)
        self._ahead = np.array([0.0, (whole + share) * config.period])

    def _tune(self, model: ReducedModel, frequency: float, damping_ratio: float) -> None:
        inertia = np.diag(model.M)[: model.n_theta]
        self.frequency = frequency
        self.K_p = frequency**2 * inertia
        self.K_d = 2.0 * damping_ratio * frequency * inertia

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
