"""The arm with variable-stiffness links against a Lagrangian of the test's own and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.reproduce.seed_004_data import arm_config, elbow_arm, place_tips
from flexarm_bringup.reproduce.seed_004_matrices import RigidLinks
from flexarm_bringup.reproduce.seed_004_motion import Ramp, SpringArm
from flexarm_bringup.sim.plant import Plant
from flexarm_model.served.linearize import linearize

Array = NDArray[np.float64]

LENGTHS = (0.040, 0.290, 0.240)  # m
MASSES = (0.77189, 0.215, 0.14752)  # kg
COMS = ((0.0, 0.04, 0.0245), (-0.133, 0.0, 0.0), (-0.115, 0.0, 0.0))  # m, in the frames of the links
INERTIAS = ((2.47e-4, 1.83e-3, 1.86e-3), (3.82e-5, 1.60e-3, 1.59e-3), (4.26e-5, 7.45e-4, 7.25e-4))  # kg m^2
G = 9.81  # m/s^2


@pytest.fixture(scope="module")
def arm() -> RigidLinks:
    return RigidLinks(arm_config())


def frames(q: Array) -> list[Array]:
    """Return the frames of the links by the printed table of Denavit and Hartenberg, (4, 4) each."""
    T, found = np.eye(4), []
    table = [(LENGTHS[0], 0.0, np.pi / 2), (0.0, LENGTHS[1], 0.0), (0.0, LENGTHS[2], 0.0)]
    for angle, (d, a, twist) in zip(q, table, strict=True):
        c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
        T = T @ np.array(
            [[c, -s * ct, s * st, a * c], [s, c * ct, -c * st, a * s], [0, st, ct, d], [0, 0, 0, 1]]
        )
        found.append(T)
    return found


def lagrangian(q: Array) -> tuple[Array, Array]:
    """Return M and G from kinetic and potential energy, motions by central differences."""
    h = 1e-6

    def state(angles: Array) -> list[tuple[Array, Array]]:
        return [((T @ (*com, 1.0))[:3], T[:3, :3]) for T, com in zip(frames(angles), COMS, strict=True)]

    M, gravity = np.zeros((3, 3)), np.zeros(3)
    turned = [(state(q + h * unit), state(q - h * unit)) for unit in np.eye(3)]
    for link, (_, R) in enumerate(state(q)):
        linear, angular = np.zeros((3, 3)), np.zeros((3, 3))
        for i, (more, less) in enumerate(turned):
            linear[:, i] = (more[link][0] - less[link][0]) / (2 * h)
            spin = (more[link][1] - less[link][1]) / (2 * h) @ R.T
            angular[:, i] = spin[2, 1], spin[0, 2], spin[1, 0]
        inertia = R @ np.diag(INERTIAS[link]) @ R.T
        M += MASSES[link] * linear.T @ linear + angular.T @ inertia @ angular
        gravity += MASSES[link] * G * linear[2]
    return M, gravity


def test_mass_matrix_and_gravity_are_those_of_the_energies(arm: RigidLinks) -> None:
    for q in np.random.default_rng(1).uniform(-np.pi, np.pi, (20, 3)):
        M, gravity = lagrangian(q)
        np.testing.assert_allclose(arm.mass_matrix(q), M, atol=1e-10)  # of the central differences
        np.testing.assert_allclose(arm.gravity(q), gravity, atol=1e-8)


def test_the_tip_is_that_of_the_printed_frames(arm: RigidLinks) -> None:
    for q in np.random.default_rng(2).uniform(-np.pi, np.pi, (20, 3)):
        np.testing.assert_allclose(arm.tip(q), frames(q)[-1][:3, 3], atol=1e-15)
        np.testing.assert_allclose(
            1e3 * arm.tip(q), place_tips(elbow_arm(arm.config), np.degrees(q)[None])[0]
        )


def test_half_the_pressure_is_half_the_stiffness_and_the_same_damping() -> None:
    (k, c), (k_soft, c_soft) = (RigidLinks(arm_config(preset)).springs for preset in ("", "soft"))
    np.testing.assert_allclose(k, np.full(3, 1.66 * 180 / np.pi))
    np.testing.assert_allclose(k_soft, k / 2)
    np.testing.assert_array_equal(c, c_soft)


def test_springs_sag_below_the_servos_and_these_carry_the_weight(arm: RigidLinks) -> None:
    model = linearize(arm.tree, np.radians([0.0, 16.0, -45.0]))
    links = np.array(model.q0)[arm.links] + model.pose
    sag = np.array(model.q0)[arm.links]
    np.testing.assert_allclose(-arm.springs[0] * sag, arm.gravity(links), atol=1e-9)
    np.testing.assert_allclose(model.f0[:3], arm.gravity(links), atol=1e-9)


def test_a_ramp_starts_a_damped_oscillation_of_the_base() -> None:
    springs, rate, q = SpringArm(), 10.0, (0.0, 16.0, -45.0)
    record = springs.follow(
        [Ramp(q[0], 30.0, rate, 0.1), Ramp(q[1], q[1], 1.0, 0.0), Ramp(q[2], q[2], 1.0, 0.0)]
    )
    links = RigidLinks(arm_config())
    inertia = links.mass_matrix(np.radians(q))[0, 0]
    k, c = (values[0] for values in links.springs)
    omega, decay = np.sqrt(k / inertia), c / (2 * inertia)
    ring = np.sqrt(omega**2 - decay**2)
    t = record.t[(record.t > 0.1) & (record.t < 0.6)] - 0.1
    expected = rate * t - rate / ring * np.exp(-decay * t) * np.sin(ring * t)
    found = record.at(t + 0.1)[:, 0]
    np.testing.assert_allclose(found, expected, atol=1e-3)  # 1 % of the overshoot: the links lift a little


def test_the_simulated_arm_hangs_still_on_its_dampers() -> None:
    config = arm_config()
    plant = Plant(config, 1.0 / config.rate_hz)
    lightest = np.linalg.eigvalsh(RigidLinks(config).mass_matrix(np.zeros(3)))[0]
    assert 1.3 / lightest * plant.dt > 2 * 2.79  # two explicit steps of a period would run away
    plant.v[:] = 1e-3
    for _ in range(200):
        plant.drive(-2.0 * (plant.theta - config.home) - 0.5 * plant.theta_dot)
    np.testing.assert_allclose(plant.theta, config.home, atol=1e-4)
    assert np.abs(plant.v).max() < 1e-4
