"""Joints from motion: closed forms of a pendulum and of two masses with a spring between them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import SINGLE_LINK
from scipy.integrate import solve_ivp

from flexarm_model.identification.joint_regression import (
    JointMotion,
    JointParameter,
    JointResult,
    identify_joints,
)
from flexarm_model.identification.rigid_limit import RigidLimit
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.tree.reduced_tree import ReducedTree

PENDULUM = """
format: flexarm/1
name: pendulum
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]
bodies:
  rotor: {type: rigid, mass: 0 kg}
  lever:
    type: rigid
    mass: 2 kg
    com: [0.5 m, 0 m, 0 m]
    inertia: [0.01 kg m^2, 0.04 kg m^2, 0.04 kg m^2, 0 kg m^2, 0 kg m^2, 0 kg m^2]
joints:
  base: {parent: world, child: rotor.root, axes: {ry: {actuated: true, rotor_inertia: 0.1 kg m^2}}}
  gear: {parent: rotor.root, child: lever.root, axes: {ry: {stiffness: 500 N m/rad, damping: 0.5 N m s/rad}}}
tip: lever.root
served: {modes: 1, home: [0 deg], rate: 500 Hz}
"""
DT, AT_LEVER = 0.002, 2.0 * 0.5**2 + 0.04  # s, kg m^2


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> ManipulatorConfig:
    path = tmp_path_factory.mktemp("arm") / "pendulum.yaml"
    path.write_text(PENDULUM, encoding="utf-8")
    return load_config(path)


def swing(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return two sines: position, velocity, acceleration in closed form."""
    parts = [(0.6, 0.31, 0.2), (0.25, 0.83, 1.1)]
    q = sum(A * np.sin(2 * np.pi * f * t + p) for A, f, p in parts)
    v = sum(A * 2 * np.pi * f * np.cos(2 * np.pi * f * t + p) for A, f, p in parts)
    a = sum(-A * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * t + p) for A, f, p in parts)
    return np.asarray(q), np.asarray(v), np.asarray(a)


def of(result: JointResult, axis: str, name: str) -> JointParameter:
    return next(p for p in result.parameters if p.axis == axis and p.name.startswith(name))


def test_the_rigid_limit_of_a_pendulum_is_its_closed_form(pendulum: ManipulatorConfig) -> None:
    """About y the lever falls for positive q: tau = J a - m g l cos q."""
    q, v, a = 0.3, 1.1, -2.0
    found = RigidLimit(pendulum, ["base.ry"]).torques(*(np.array([x]) for x in (q, v, a))).sum()
    assert found == pytest.approx(AT_LEVER * a - 2.0 * 9.81 * 0.5 * np.cos(q), rel=1e-9)


def test_friction_and_rotor_of_a_rigid_pendulum_come_back(pendulum: ManipulatorConfig) -> None:
    t = np.arange(0.0, 20.0, DT)
    q, v, a = swing(t)
    m_g_l, rotor, b, c = 2.0 * 9.81 * 0.5, 0.16, 0.7, 1.3
    tau = (AT_LEVER + rotor) * a - m_g_l * np.cos(q) + b * v + c * np.tanh(v / 0.01)
    held = np.interp(t + DT / 2, t, tau)  # a drive holds it from sample to sample
    result = identify_joints(pendulum, JointMotion(("base.ry",), q[:, None], held[:, None], DT), 4.0)
    for name, value in (("rotor", rotor), ("viscous", b), ("Coulomb", c)):
        parameter = of(result, "base.ry", name)
        assert parameter.is_told
        assert parameter.value == pytest.approx(value, rel=0.03, abs=0.02), name
    assert of(result, "base.ry", "offset").value == pytest.approx(0.0, abs=0.05)
    assert result.fit[0] > 98.0 and result.condition < 1e4


@pytest.mark.parametrize("is_held", [True, False])
def test_torque_counts_as_held_only_where_it_is(pendulum: ManipulatorConfig, is_held: bool) -> None:
    """Samples of one instant counted as held: half a step made 0.742 +- 0.007 of a friction of 0.7."""
    dt = 0.01  # s
    t = np.arange(0.0, 20.0, dt)
    q, v, a = swing(t + dt / 2 if is_held else t)
    tau = (AT_LEVER + 0.1) * a - 2.0 * 9.81 * 0.5 * np.cos(q) + 0.7 * v
    motion = JointMotion(("base.ry",), swing(t)[0][:, None], tau[:, None], dt, is_held)
    right, wrong = (
        of(identify_joints(pendulum, each, 4.0), "base.ry", "viscous")
        for each in (motion, replace(motion, is_held=not is_held))
    )
    print(f"held {is_held}: {right.value:.3f}, taken for the other {wrong.value:.3f} +- {wrong.sigma:.3f}")
    assert right.value == pytest.approx(0.7, abs=0.01) and abs(wrong.value - 0.7) > 0.03


def test_the_spring_of_a_motors_axis_is_not_taken_for_its_rotor(tmp_path: Path) -> None:
    """Without it among the unknowns the rotor was found negative."""
    path = tmp_path / "sprung.yaml"
    path.write_text(
        PENDULUM.replace("actuated: true", "actuated: true, stiffness: 4 N m/rad"), encoding="utf-8"
    )
    t = np.arange(0.0, 20.0, DT)
    q, v, a = swing(t)
    rotor, b, k = 0.16, 0.7, 5.0
    tau = (AT_LEVER + rotor) * a - 2.0 * 9.81 * 0.5 * np.cos(q) + b * v + k * q
    held = np.interp(t + DT / 2, t, tau)
    motion = JointMotion(("base.ry",), q[:, None], held[:, None], DT)
    result = identify_joints(load_config(path), motion, 4.0)
    for name, value in (("rotor", rotor), ("viscous", b), ("stiffness", k)):
        assert of(result, "base.ry", name).value == pytest.approx(value, rel=0.05, abs=0.02), name
    assert result.fit[0] > 98.0


def test_a_spring_between_motor_and_link_comes_back(pendulum: ManipulatorConfig) -> None:
    """Two inertias and a spring, integrated by scipy; the description is 20 % too soft."""
    k, d, rotor = 600.0, 0.8, 0.1

    def torque(t: float) -> float:
        return 8.0 * np.sin(2 * np.pi * 0.9 * t) + 6.0 * np.sin(2 * np.pi * 2.3 * t + 1.0)

    def rates(t: float, x: np.ndarray) -> list[float]:
        theta, delta, w, u = x
        weight = -2.0 * 9.81 * 0.5 * np.cos(theta + delta)
        through = k * delta + d * u
        motor = (torque(t) + through) / rotor
        link = (-through - weight) / AT_LEVER
        return [w, u, motor, link - motor]

    t = np.arange(0.0, 8.0, DT)
    x = solve_ivp(rates, (0.0, 8.0), [1.57, 0.0, 0.0, 0.0], t_eval=t, rtol=1e-8, atol=1e-10).y
    tau = np.column_stack([[torque(s + DT / 2) for s in t], np.zeros(t.size)])
    motion = JointMotion(("base.ry", "gear.ry"), x[:2].T.copy(), tau, DT)
    result = identify_joints(pendulum, motion, 8.0)
    stiffness = of(result, "gear.ry", "stiffness")
    assert stiffness.is_told and stiffness.value == pytest.approx(k, rel=0.02)
    assert of(result, "base.ry", "rotor").value == pytest.approx(rotor, rel=0.03)
    assert of(result, "base.ry", "Coulomb").value == pytest.approx(0.0, abs=0.05)


def test_an_axis_that_does_not_move_tells_nothing_and_says_so(pendulum: ManipulatorConfig) -> None:
    rng = np.random.default_rng(0)
    q, tau = 1e-6 * rng.standard_normal((3000, 1)), -9.81 + 1e-3 * rng.standard_normal((3000, 1))
    result = identify_joints(pendulum, JointMotion(("base.ry",), q, tau, DT), 4.0)
    assert not of(result, "base.ry", "rotor").is_told and not of(result, "base.ry", "viscous").is_told
    assert result.moving[0] == 0.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_motor_that_a_loop_holds_still_tells_neither_rotor_nor_friction(seed: int) -> None:
    """It answers the noise of its encoder: rotors of -0.15 and 0.62 were found, to 0.03, for one of 0.3."""
    rng, inertia, dt = np.random.default_rng(seed), 0.35, 0.005
    omega, sigma, step = 11.0, 3e-5, 6e-5  # of the loop [rad/s]; rad; of the encoder [rad]
    q, v, last, rows = 0.0, 0.0, 0.0, []
    for _ in range(6000):
        seen = step * round((q + sigma * rng.standard_normal()) / step)
        tau = -inertia * (omega**2 * seen + 1.4 * omega * (seen - last) / dt)
        rows.append((seen, tau))
        v += tau / inertia * dt
        q, last = q + v * dt, seen
    seen, tau = np.array(rows).T
    motion = JointMotion(("base.rz",), seen[:, None], tau[:, None], dt)
    result = identify_joints(load_config(SINGLE_LINK, "geared"), motion, 1.0)
    assert not any(p.is_told for p in result.parameters if p.name != "offset")


def test_the_bias_is_what_bending_does_to_a_described_arm(pendulum: ManipulatorConfig) -> None:
    """Its spring is not measured: what the rigid arm misses is 4 % of the rotor, 19 of its sigmas."""
    rotor, k, d, t = 0.1, 500.0, 0.5, np.arange(0.0, 30.0, DT)

    def torque(s: float) -> float:
        return float(np.sin(2 * np.pi * 0.4 * s) + 2.0 * np.sin(2 * np.pi * 0.85 * s + 1.0))

    def rates(s: float, x: np.ndarray) -> list[float]:
        theta, delta, w, u = x
        through = k * delta + d * u
        motor = (torque(s) + through - w) / rotor  # with a friction of 1 N m s/rad
        link = (-through + 2.0 * 9.81 * 0.5 * np.cos(theta + delta)) / AT_LEVER
        return [w, u, motor, link - motor]

    x = solve_ivp(rates, (0.0, 30.0), [np.pi / 2, 0, 0, 0], t_eval=t, rtol=1e-8, atol=1e-10).y
    motion = JointMotion(("base.ry",), x[:1].T.copy(), np.array([[torque(s + DT / 2)] for s in t]), DT)
    rigid, bent = (
        identify_joints(pendulum, motion, 0.95, tree)
        for tree in (None, ReducedTree(pendulum, use_compiler=False))
    )
    for name, true in (("rotor", rotor), ("links", 1.0)):
        before, after = of(rigid, "base.ry", name), of(bent, "base.ry", name)
        assert after.value == before.value and before.bias == 0.0
        assert after.bias == pytest.approx(after.value - true, rel=0.2), name
        assert abs(after.value - true) < 1.3 * after.sigma, name


def test_rotor_and_link_of_a_horizontal_arm_are_one_combination() -> None:
    """Without gravity both are the same column: the condition number says so, and which they are."""
    config = load_config(SINGLE_LINK, "geared")
    t = np.arange(0.0, 10.0, 0.005)
    q, _, a = swing(t)
    motion = JointMotion(("base.rz",), q[:, None], 0.4 * a[:, None], 0.005)
    result = identify_joints(config, motion, 2.0)
    assert result.condition > 1e6
    assert "rotor inertia" in result.weakest and "links" in result.weakest


def test_loops_unknown_axes_and_short_motions_are_refused(pendulum: ManipulatorConfig) -> None:
    loops = load_config(SINGLE_LINK.with_name("planar_3rrr.yaml"), "")
    with pytest.raises(ValueError, match="closed loops"):
        RigidLimit(loops, ["motor_1.rz"])
    with pytest.raises(ValueError, match="no axis elbow.rz; pendulum has base.ry"):
        RigidLimit(pendulum, ["elbow.rz"])
    short = JointMotion(("base.ry",), np.zeros((300, 1)), np.zeros((300, 1)), DT)
    with pytest.raises(ValueError, match="too short"):
        identify_joints(pendulum, short, 4.0)


def test_the_rotor_of_a_body_without_mass_counts(tmp_path: Path) -> None:
    """A motor side described by its inertia alone; it was lost, and 0.6 found for a rotor of 0.1 kg m^2."""
    inertia = "inertia: [0.5 kg m^2, 0.5 kg m^2, 0.5 kg m^2, 0 kg m^2, 0 kg m^2, 0 kg m^2]"
    path = tmp_path / "pendulum.yaml"
    path.write_text(PENDULUM.replace("mass: 0 kg}", f"mass: 0 kg, {inertia}}}"), encoding="utf-8")
    rigid = RigidLimit(load_config(path), ["base.ry", "gear.ry"])
    torques = [
        rigid.torques(np.array([np.pi / 2, 0.0]), np.zeros(2), np.array([a, 0.0])).sum(axis=1)[0]
        for a in (0.0, 1.0)
    ]
    assert torques[1] - torques[0] == pytest.approx(0.5 + AT_LEVER, rel=1e-9)


def test_nothing_is_told_where_nothing_moves_or_pushes(pendulum: ManipulatorConfig) -> None:
    """A sigma before of nothing made zero friction a finding."""
    still = np.zeros((3000, 1))
    result = identify_joints(pendulum, JointMotion(("base.ry",), still, still, DT), 4.0)
    assert not any(of(result, "base.ry", name).is_told for name in ("rotor", "viscous", "Coulomb"))
    assert all(p.prior > 0.0 for p in result.parameters)
