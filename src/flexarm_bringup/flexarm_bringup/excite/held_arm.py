"""The described arm held at its home pose by joint PD, and how it answers a torque added to that.

With ``x`` counted from rest at the pose, ``G`` the gains on the axes and ``r`` the torque added::

    x+ = (A - B G) x + B r        y = C x + D u        u = r - G x

That is what plans look at. What sensors are to say, ``pushed`` and ``shaken``, is computed with all modes of
the arm and the delays of its loop: without them sound channels answer with up to 1.36 times the prediction.
Encoders that are noisy shake an arm that is held, and the faster its motors are sampled the more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.motor_side import SMOOTHING
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.joint_loop import GAIN_MARGIN, JointLoop
from flexarm_controller.joint_pd import JointPd
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.modes import damped_poles
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
LONGEST_SETTLING = 10.0  # s; an arm held more weakly than that hardly moves by itself
DELAY = 3  # periods from an encoder to the torque: one for the command, two for the smoothed velocity


@dataclass(frozen=True)
class Answer:
    """Predicted deviations from rest.

    Attributes:
        tau: Torque of the drives [N m or N], (n, n_theta).
        theta: Actuated axes [rad or m], (n, n_theta).
        theta_dot: Their velocity, (n, n_theta).
        y: Output rows of the model, SI, (n, n_y).
    """

    tau: Array
    theta: Array
    theta_dot: Array
    y: Array


class HeldArm:
    """Holds an arm at home, and predicts what it does.

    Attributes:
        config: The description.
        model: The served model at home.
        dt: Motor period [s].
        tau_rest: Torque that holds the pose [N m or N], (n_theta,).
        ranges: How fast the guard lets every axis approach the ends of its range.
    """

    def __init__(self, config: ManipulatorConfig) -> None:
        """Tune the joint loops to the served model.

        Raises:
            PoseError: There is no model at the home pose.
            ValueError: There is no motor, or joint PD does not hold the arm there.
        """
        if not config.actuated:
            raise ValueError(f"{config.name} has no motor: nothing can hold or excite it")
        tree = ReducedTree(config)
        self.config, self.model = config, linearize(tree)
        self.ranges = guard_limits(config, tree, GuardSettings()).ranges
        self.dt = round(1e9 / config.rate_hz) * 1e-9
        self._law = JointPd(self.model, ControllerConfig(period=self.dt), MpcConfig(delay_periods=DELAY))
        self._plant = plant(self.model, self.dt)
        every = tree.motions_within(self.model.q0).shape[1] - self.model.n_theta
        self._whole = plant(linearize(tree, modes=every), self.dt)
        loop = JointLoop(self.model, self.dt, DELAY)
        if not loop.is_stable(self._law.K_p, self._law.K_d):
            raise ValueError(
                f"{config.name}: no joint PD that bears twice its gains holds it at "
                f"{np.round(config.home, 6).tolist()}: "
                f"{_limited_by(loop, self._law, tuple(config.actuated))}. Expected another pose (--pose)"
            )
        self._goal = hold(config.home)
        self.tau_rest = self.torque(config.home, np.zeros(self.model.n_theta))

    def torque(self, theta: Array, theta_dot: Array) -> Array:
        """Return the torque that holds the pose, from what the drives measure, (n_theta,)."""
        eta = np.zeros(self.model.n_eta)
        none = np.zeros(self.model.n_theta)
        state = ArmState(0.0, self.model.model_id, theta, eta, theta_dot, eta, none)
        return self._law.step(state, self._goal, np.zeros((0, none.size)))

    @property
    def elastic_poles(self) -> Complex:
        """Poles of the served modes with the motors free, slowest first [rad/s], (n_eta,)."""
        poles = damped_poles(self.model.M, self.model.D, self.model.K)
        return np.asarray(poles[np.argsort(abs(poles))][poles.size - self.model.n_eta :])

    @property
    def settling_time(self) -> float:
        """Time in which the joint loops come to rest [s]."""
        decay = self._law.damping_ratio * self._law.frequency.min()
        return float(min(6.0 / decay, LONGEST_SETTLING))

    def rooms(self) -> dict[str, tuple[float, float]]:
        """Return what every limit on torque and range leaves at rest, and its size, SI, by name."""
        rooms: dict[str, tuple[float, float]] = {}
        for (name, axis), home, tau in zip(
            self.config.actuated.items(), self.config.home, self.tau_rest, strict=True
        ):
            distance = min(axis.upper - home, home - axis.lower)
            rooms[f"torque of {name}"] = axis.effort - abs(float(tau)), axis.effort
            rooms[f"range of {name}"] = float(distance), axis.upper - axis.lower
        limits = {spec.name: (spec.limit, spec.low, spec.high) for spec in self.config.sensors}
        for row, name in self.sensed_rows():
            limit, low, high = limits[name.rpartition(".")[0]]
            y0 = float(self.model.outputs.y0[row])
            rooms[f"range of {name}"] = min(limit - abs(y0), high - y0, y0 - low), min(limit, high - low)
        return rooms

    def sensed_rows(self) -> list[tuple[int, str]]:
        """Return rows of the model's outputs that belong to sensors, and their names "sensor.channel"."""
        outputs = self.model.outputs
        return [(row, outputs.names[row]) for spec in self.config.sensors for row in outputs.rows(spec.name)]

    def respond(self, added: Array) -> Answer:
        """Return the answer to a torque added from rest on, (n, n_theta) [N m or N]."""
        system, m, gain = self._plant, self.model.n_theta, self._gain()
        A, driven = system.A - system.B @ gain, added @ system.B.T  # (n, n_x)
        x = np.zeros((len(added) + 1, system.n_x))
        for k, push in enumerate(driven):
            x[k + 1] = A @ x[k] + push
        x = x[:-1]
        tau = added - x @ gain.T
        before = np.vstack([np.zeros(m), tau[:-1]])  # a sample feels the torque that acted until then
        y = x @ system.C.T + before @ system.D.T
        return Answer(tau, x[:, :m], x[:, system.n_xi : system.n_xi + m], y)

    def shaken(self, count: int, seed: int = 0) -> Array:
        """Return what the rows show of a held arm while its encoders have their noise, (count, n_y)."""
        m = self.model.n_theta
        kinds = {spec.site: spec.sigma[0] for spec in self.config.sensors if spec.kind == "encoder"}
        sigma = np.array([kinds.get(axis, 0.0) for axis in self.config.actuated])
        noise = sigma * np.random.default_rng(seed).standard_normal((count + 1, m))
        return self._as_driven(np.zeros((count, m)), noise)

    def pushed(self, added: Array) -> Array:
        """Return what the rows show after a torque that is added from rest on, (n, n_y).

        Args:
            added: Torque that acts from each period on, (n, n_theta) [N m or N].
        """
        return self._as_driven(added, np.zeros((len(added) + 1, self.model.n_theta)))

    def _as_driven(self, added: Array, noise: Array) -> Array:
        """Return the rows under the loop with its delays, of the arm with all its modes, (n, n_y).

        Velocities are differences of positions, smoothed as the drives do; what holds acts one period later.
        """
        system, m = self._whole, self.model.n_theta
        velocity, acts, ordered, x = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(system.n_x)
        told, y = noise[0], np.empty((len(added), len(system.C)))
        for k, push in enumerate(added):
            y[k] = system.C @ x + system.D @ acts  # a sample feels the torque that acted until then
            before, told = told, x[:m] + noise[k + 1]
            velocity += SMOOTHING * ((told - before) / self.dt - velocity)
            acts, ordered = ordered + push, -self._law.K_p * told - self._law.K_d * velocity
            x = system.A @ x + system.B @ acts
        return y

    def _gain(self) -> Array:
        """Return the torque per state, turned about, (n_theta, n_x)."""
        m, n = self.model.n_theta, self.model.n
        gain = np.zeros((m, self._plant.n_x))
        gain[:, :m], gain[:, n : n + m] = np.diag(self._law.K_p), np.diag(self._law.K_d)
        return gain


def _limited_by(loop: JointLoop, law: JointPd, axes: tuple[str, ...]) -> str:
    """Return what keeps joint PD from holding an arm that moves by itself."""
    K_p, K_d = (GAIN_MARGIN * gain for gain in law.gains(law.wanted))
    ringing_hz = loop.ringing_hz(K_p, K_d)
    if not ringing_hz:
        return "it moves by itself, also with the most gain that stays below its modes"
    axis = axes[loop.culprit(K_p, K_d)]
    return f"with little gain it moves by itself, with more {axis} makes a mode of {ringing_hz:.3g} Hz ring"
