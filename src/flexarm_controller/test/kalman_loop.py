"""A closed loop for the tests: exact linear plant, noisy sensors, stationary Kalman filter, controller."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm, solve_discrete_are
from scipy.signal import butter, filtfilt
from served_arms import SENSOR, TIP, limits_of_hub, single_link, state_of

from flexarm_controller.controller import Controller
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_model.motion.profiles import Trapezoid
from flexarm_model.motion.shapers import shape, zvd
from flexarm_model.served.state_space import discretize, state_space

DT, FINE = 0.005, 5  # s, plant steps per period
SIGMA = np.array([20e-6, 1e-6, 0.03])  # encoder [rad], strain, accelerometer [m/s^2]: seed 002
AFTER = 2.3  # s that are simulated after the motion
FORCE = 0.15  # kg^0.5 m/s^2, what the filter does not know of the modes: 10 % of frequency
TORQUE_NOISE, DRIFT = 0.005, 0.05  # rad/s^2/sqrt(Hz), rad/s^2/sqrt(s): of the axis, times its inertia


@dataclass(frozen=True)
class Outcome:
    """What a move was worth: residual [m/s^2], settling [s], torques [N m], strains, modes used."""

    residual: float
    settling: float
    torque: float
    strain: float
    modes: set


def case_a(angle):
    return Trapezoid.published("A", angle, 1 / 5.23)


def shaped(angle):
    return shape(case_a(angle), zvd(2 * np.pi * 5.23, 0.015))


def reference_of(profile):
    t = np.arange(0.0, profile.duration + DT, DT / 2)
    return Reference(t, *(np.array(part)[:, None] for part in profile.sample(t)))


def residual(relative, t, end):
    rate = 1 / (t[1] - t[0])
    filtered = filtfilt(*butter(4, 20 / (rate / 2)), relative)
    return float(np.sqrt(np.mean(filtered[(t >= end + 0.1) & (t <= end + 2.1)] ** 2)))


def ideal_servo(profile):
    """Return the residual when the hub follows the profile exactly."""
    model, h = single_link(), DT / FINE
    t = np.arange(0.0, profile.duration + AFTER, h)
    drive = profile.sample(t + h / 2)[2]
    relative = np.zeros(t.size)
    for omega, zeta, coupling, shape_at in zip(
        model.omega, model.zeta, model.M[0, 1:], model.outputs.C_acc[2, 1:], strict=True
    ):
        A = np.array([[0, 1, 0], [-(omega**2), -2 * zeta * omega, -coupling], [0, 0, 0]])
        step, x = expm(A * h), np.zeros(2)
        for k, acceleration in enumerate(drive):
            relative[k] += shape_at * (A[1, :2] @ x - coupling * acceleration)
            x = step[:2, :2] @ x + step[:2, 2] * acceleration
    return residual(relative, t, profile.duration)


class Filter:
    """Stationary Kalman filter on encoder, strain and accelerometer, with a torque disturbance."""

    def __init__(self, model):
        inertia = model.M[0, 0]
        force = np.append((TORQUE_NOISE * inertia) ** 2, 2 * FORCE**2 / model.omega)
        self.s = discretize(state_space(model, force, np.array([(DRIFT * inertia) ** 2])), DT)
        R = np.diag(SIGMA**2)
        R[2, 2] += 0.1**2  # m/s^2: what the accelerometer feels of the unknown forces
        C = self.s.C[:3]
        P = solve_discrete_are(self.s.A.T, C.T, self.s.Q, R)
        self.gain = np.linalg.solve(C @ P @ C.T + R, C @ P).T
        self.x = np.zeros(9)

    def correct(self, y, felt):
        self.x = self.x + self.gain @ (y - self.s.C[:3] @ self.x - self.s.D[:3] @ felt - self.s.y_c[:3])

    def predict(self, torque):
        self.x = self.s.A @ self.x + self.s.B @ torque + self.s.c


def run_move(hub, profile, frequency_scale=1.0, law="mpc", mpc=None, limits=None, seed=1):
    """Move the arm along the profile and return the outcome; the plant's frequencies are scaled."""
    model, real = single_link(hub), single_link(hub, frequency_scale)
    plant = discretize(state_space(real, np.zeros(4)), DT / FINE)
    accelerations = state_space(real, np.zeros(4))
    limits, mpc = limits or limits_of_hub(hub), mpc or MpcConfig(time_limit=0.0)
    controller = Controller(model, limits, ControllerConfig(law=law), mpc)
    assert not controller.follow(reference_of(profile))
    kalman, rng = Filter(model), np.random.default_rng(seed)
    x, torque, felt = np.zeros(8), np.zeros(1), np.zeros(1)
    relative, tip, torques, strain, modes = [], [], [], [], set()
    for k in range(round((profile.duration + AFTER) / DT)):
        y = plant.C[:3] @ x + plant.D[:3] @ felt + SIGMA * rng.standard_normal(3)
        kalman.correct(y, felt)
        command = controller.step(state_of(kalman.x[:8], model, k * DT, kalman.x[8:]))
        modes.add(command.mode)
        for _ in range(FINE):
            a = (accelerations.A @ x + accelerations.B @ torque)[4:]
            relative.append(real.outputs.C_acc[2] @ a - SENSOR * a[0])
            tip.append(real.outputs.C_pos[3] @ x[:4])
            strain.append(real.outputs.C_pos[1] @ x[:4])
            x = plant.A @ x + plant.B @ torque
        kalman.predict(torque)
        torques.append(torque)
        felt, torque = torque, command.tau
        assert abs(x).max() < 1e3, "unstable"
    t = np.arange(len(tip)) * DT / FINE
    outside = np.flatnonzero(abs(np.array(tip) - TIP * profile.sample(1e3)[0][0]) > 0.5e-3)
    return Outcome(
        residual(np.array(relative), t, profile.duration), t[outside[-1]] + DT / FINE - profile.duration,
        abs(np.array(torques)).max(), abs(np.array(strain)).max(), modes,
    )  # fmt: skip
