"""Small served models for the tests, written down by hand, and limits that fit them."""

import numpy as np

from flexarm_controller.limits import Limits
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import Outputs, ReducedModel

OUTPUTS = ("encoder.position", "root_strain.strain", "tip_accelerometer.y", "tip.ty")
UNITS = ("rad", "1", "m/s^2", "m")
TIP = 0.64  # m, from the axis
SENSOR = 0.63  # m
HUBS = {"geared": (0.30, 28.0), "light_hub": (0.01, 2.0)}  # inertia [kg m^2], torque [N m]: seed 002


def single_link(hub="geared", frequency_scale=1.0):
    """Return about the arm of seed 002: three modes, participation as printed there."""
    omega = 2 * np.pi * np.array([5.230, 36.22, 106.3]) * frequency_scale
    participation = np.array([0.6854, -0.0685, 0.0180])  # m, of the sensor per hub acceleration
    shape = np.array([2.98, -2.2, 2.1])  # kg^-0.5, at the sensor
    M = np.eye(4)
    M[0, 0] = HUBS[hub][0] + 0.0648
    M[0, 1:] = M[1:, 0] = participation / shape
    zeta = np.full(3, 0.015)
    D, K, B = np.zeros((4, 4)), np.zeros((4, 4)), np.zeros((4, 1))
    D[1:, 1:], K[1:, 1:], B[0, 0] = np.diag(2 * zeta * omega), np.diag(omega**2), 1.0
    C_pos, C_acc = np.zeros((4, 4)), np.zeros((4, 4))
    C_pos[0, 0] = 1.0
    C_pos[1, 1:] = [0.0265, -0.15, 0.38]
    C_pos[3] = [TIP, *(1.02 * shape)]
    C_acc[2] = [SENSOR, *shape]
    outputs = Outputs(OUTPUTS, UNITS, np.zeros(4), C_pos, np.zeros((4, 4)), C_acc)
    return ReducedModel(
        "single_link", "by hand", ("base.rz",), np.zeros(1), M, D, K, B, np.zeros(4), omega, zeta, outputs,
        np.zeros(4), np.eye(4),
    )  # fmt: skip


def limits_of_hub(hub="geared", effort=None, strain=1e-3, effort_rate=None):
    """Return limits of the single link; a smaller torque or strain to make them bind."""
    effort = HUBS[hub][1] if effort is None else effort
    rate = 100 * effort if effort_rate is None else effort_rate
    return Limits(
        np.array([effort]), np.array([rate]), np.array([6.0]), np.array([-3.0]), np.array([3.0]),
        ("root_strain.strain",), np.array([strain]),
    )  # fmt: skip


def two_axes(seed=3):
    """Return a two-axis arm in a pose, with springs, joint friction, gravity and static coupling."""
    rng = np.random.default_rng(seed)
    n, omega, zeta = 5, 2 * np.pi * np.array([4.0, 9.0, 30.0]), np.array([0.01, 0.02, 0.015])
    half = 0.3 * rng.standard_normal((n, n))
    M = np.eye(n)
    M[:2, :2] += np.eye(2) + (half @ half.T)[:2, :2]
    M[:2, 2:] = 0.2 * half[:2, 2:]
    M[2:, :2] = M[:2, 2:].T
    K, D = np.zeros((n, n)), np.zeros((n, n))
    K[:2, :2], K[2:, 2:] = np.diag([3.0, 0.0]), np.diag(omega**2)
    D[:2, :2], D[2:, 2:] = np.diag([0.4, 0.1]), np.diag(2 * zeta * omega)
    f0 = np.array([1.5, -0.7, 0.3, -0.2, 0.1])
    C_pos = rng.standard_normal((3, n))
    outputs = Outputs(
        ("gauge_a.strain", "gauge_b.strain", "tip.tx"), ("1", "1", "m"), np.array([0.01, -0.02, 0.5]), C_pos,
        np.zeros((3, n)), np.zeros((3, n)),
    )  # fmt: skip
    return ReducedModel(
        "two_axes", "by hand", ("a.rz", "b.rz"), np.array([0.3, -0.2]), M, D, K, np.eye(n)[:, :2], f0, omega,
        zeta, outputs, np.zeros(n), np.eye(n),
    )  # fmt: skip


def two_axis_limits(effort=(8.0, 6.0), strain=(5.0, 5.0)):
    """Return limits of the two-axis arm."""
    effort = np.array(effort)
    return Limits(
        effort, 40 * effort, np.array([3.0, 3.0]), np.full(2, -2.0), np.full(2, 2.0),
        ("gauge_a.strain", "gauge_b.strain"), np.array(strain),
    )  # fmt: skip


def state_of(x, model, t=0.0, d=None):
    """Return the arm state of x = [theta; eta; theta'; eta'], (2 n,)."""
    n, m = model.n, model.n_theta
    x = np.asarray(x, float)
    d = np.zeros(m) if d is None else np.asarray(d, float)
    return ArmState(t, model.model_id, x[:m], x[m:n], x[n : n + m], x[n + m :], d)
