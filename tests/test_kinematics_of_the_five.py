"""Closed forms against the bodies of the descriptions, axis by axis, on random poses.

Geometry is read from the description; the closed form says where every axis of it stands, passive
ones, too. Put into the joints one after the other these must place the tip, and meet where loops close.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from body_chain import Array, Values, check, described, joint, shifted, transform, tree
from scipy.spatial.transform import Rotation

from flexarm_model.kinematics.body_mechanism import held_mechanism
from flexarm_model.kinematics.dh import DhChain, DhRow
from flexarm_model.kinematics.elbow_arm import ElbowArm
from flexarm_model.kinematics.joint_path import follow
from flexarm_model.kinematics.numeric import solve_inverse
from flexarm_model.kinematics.paths import at_speed, rounded_square, travel
from flexarm_model.kinematics.planar_legs import PlanarLeg, PlanarLegs
from flexarm_model.kinematics.spherical_wrist import SphericalWristArm
from flexarm_model.kinematics.telescopic_legs import TelescopicLeg, TelescopicLegs
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import find_equilibrium

POSES = 50
OPEN, CLOSED = 1e-12, 1e-10  # m and 1


def yaw(placement: Array) -> float:
    return float(np.arctan2(placement[1, 0], placement[0, 0]))


def named_poses(name: str) -> Iterator[tuple[str, Array]]:
    config = described(name)
    yield from {"home": config.home, **config.poses}.items()


# ---- the single link of seed 002


@pytest.mark.parametrize("seed", range(POSES))
def test_single_link_equals_its_bodies(seed: int) -> None:
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, 1)
    reach = joint("clamp", "single_link").placement[0, 3] + described("single_link").bodies["strip"].length
    assert reach == pytest.approx(0.640)  # 10 mm beside the axis, 630 mm free (seed 002)
    check("single_link", {"base.rz": float(q[0])}, DhChain((DhRow(0.0, reach, 0.0),)).pose(q), OPEN)


# ---- the elbow arm of seed 004


def elbow_arm(preset: str = "") -> ElbowArm:
    config = load_config(find_manipulator("variable_stiffness"), preset)
    lengths = [("link_1", "base"), ("link_2", "shoulder"), ("link_3", "elbow")]
    return ElbowArm(*(float(np.linalg.norm(config.bodies[b].nodes[n])) for b, n in lengths))


def test_elbow_arm_has_the_lengths_of_its_presets() -> None:
    printed = {"dynamics": (0.040, 0.290, 0.240), "table_3": (0.040, 0.295, 0.240)}
    for preset, lengths in {**printed, "calibrated": (0.04025, 0.2952, 0.2366)}.items():
        arm = elbow_arm(preset)
        assert (arm.height, arm.upper, arm.fore) == pytest.approx(lengths, rel=1e-12)


@pytest.mark.parametrize("seed", range(POSES))
def test_elbow_arm_equals_its_bodies(seed: int) -> None:
    arm = elbow_arm()
    q = np.random.default_rng(seed).uniform([-2.0, -0.5, -2.0], [2.0, 3.0, 2.0])
    tip = arm.chain.pose(q)
    np.testing.assert_allclose(tip[:3, 3], arm.position(q), atol=OPEN)
    for solution in (q, arm.nearest(tip[:3, 3], q)):
        values = dict(zip(("base.ry", "shoulder.rz", "elbow.rz"), solution, strict=True))
        check("variable_stiffness", values, tip, OPEN)


# ---- the six-axis arm of seed 003

SIX = SphericalWristArm(d1=0.50, a1=0.18, a2=0.80, a3=0.15, d4=0.85, d6=0.14)
MOTORS = ("motor_1.rz", "motor_2.ry", "motor_3.ry", "motor_4.rx", "motor_5.ry", "motor_6.rx")
DISC = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # x along the flange's z, z along its x


def disc_of(flange: Array) -> Array:
    """Return the frame of the last body from the flange's of Denavit and Hartenberg, (4, 4)."""
    return transform(flange[:3, :3] @ DISC, flange[:3, 3])


@pytest.mark.parametrize("seed", range(POSES))
def test_six_axis_arm_equals_its_bodies(seed: int) -> None:
    q = np.random.default_rng(seed).uniform(-1.5, 1.5, 6)
    flange = SIX.chain.pose(q)
    for solution in (q, SIX.nearest(flange, q)):
        check("serial_6r", dict(zip(MOTORS, solution, strict=True)), disc_of(flange), OPEN)


def test_numeric_inverse_of_the_bodies_is_the_closed_form() -> None:
    mechanism = held_mechanism(tree("serial_6r"))
    for q in [theta for _, theta in named_poses("serial_6r")]:
        found = solve_inverse(mechanism, disc_of(SIX.chain.pose(q)), q + 0.05)
        np.testing.assert_allclose(found.theta, SIX.nearest(SIX.chain.pose(q), q), atol=1e-7)  # 1e-9 m, rad


def test_square_path_keeps_the_limits_of_the_six_axis_arm() -> None:
    """Seed 003, section 2: side 0.40 m, corners 0.05 m, 500 mm/s, tool down."""
    way = rounded_square(np.array([1.25, 0.0, 0.80]), 0.40, 0.05)
    profile = at_speed(way.length, 0.5, 5.0)
    motion = travel(way, np.diag([1.0, -1.0, -1.0]), profile, np.linspace(0.0, profile.duration, 500))
    joints = follow(SIX.nearest, SIX.chain.jacobian, motion, described("serial_6r").home)
    axes = list(described("serial_6r").actuated.values())
    assert (joints.theta > [axis.lower for axis in axes]).all()
    assert (joints.theta < [axis.upper for axis in axes]).all()
    assert (abs(joints.theta_dot) < [axis.velocity for axis in axes]).all()


# ---- the planar legs of seed 000


def planar_legs() -> PlanarLegs:
    config = described("planar_3rrr")
    return PlanarLegs(
        tuple(
            PlanarLeg(
                base=joint(f"motor_{i}", "planar_3rrr").placement[:2, 3],
                hinge=config.bodies["platform"].nodes[f"hinge_{i}"][:2],
                first=config.bodies[f"first_{i}"].length,
                second=config.bodies[f"second_{i}"].length,
                bend=-1,
            )
            for i in (1, 2, 3)
        )
    )


def planar_values(legs: PlanarLegs, pose: Array) -> Values:
    angles = legs.angles(pose)
    values: Values = {}
    for i in range(3):
        names = [f"{part}_{i + 1}" for part in ("motor", "elbow", "hinge")]
        turns = (angles.first[i], angles.elbow[i], angles.hinge[i])
        for name, turn in zip(names, turns, strict=True):
            value = turn - yaw(joint(name, "planar_3rrr").placement)
            values[f"{name}.rz"] = float((value + np.pi) % (2 * np.pi) - np.pi)
    return values


def planar_pose(pose: Array) -> Array:
    return transform(Rotation.from_euler("z", pose[2]).as_matrix(), np.array([*pose[:2], 0.0]))


@pytest.mark.parametrize("seed", range(POSES))
def test_planar_legs_equal_their_bodies(seed: int) -> None:
    legs = planar_legs()
    pose = np.random.default_rng(seed).uniform([-0.1, -0.1, -0.3], [0.1, 0.1, 0.3])
    check("planar_3rrr", planar_values(legs, pose), planar_pose(pose), CLOSED)
    np.testing.assert_allclose(legs.pose(legs.angles(pose).first, 0.9 * pose), pose, atol=CLOSED)


def test_named_poses_of_the_planar_robot_are_those_of_the_note() -> None:
    meant = {"home": (0.0, 0.0, 0.0), "A": (-0.05, -0.05, 0.0), "B": (0.05, 0.05, 0.0)}
    legs, reduced = planar_legs(), tree("planar_3rrr")
    for label, theta in named_poses("planar_3rrr"):
        found = reduced.tip_pose(find_equilibrium(reduced, theta)[0])
        np.testing.assert_allclose(found, planar_pose(np.array(meant[label])), atol=2e-8)  # rounded angles
        values = planar_values(legs, np.array(meant[label]))
        closed = [values[f"motor_{i}.rz"] for i in (1, 2, 3)]
        np.testing.assert_allclose(theta, closed, atol=2e-8)


# ---- the telescopic legs of seed 001


def telescopic_legs() -> TelescopicLegs:
    nodes = described("spatial_3tpt").bodies["platform"].nodes
    mounts = [joint(f"base_{i}", "spatial_3tpt").placement for i in (1, 2, 3)]
    return TelescopicLegs(
        tuple(
            TelescopicLeg(mount[:3, 3], nodes[f"leg_{i}"], mount[:3, :3], mount[:3, :3])
            for i, mount in enumerate(mounts, start=1)
        )
    )


def telescopic_values(legs: TelescopicLegs, T: Array) -> Values:
    config = described("spatial_3tpt")
    carrier = np.linalg.inv(joint("constraint", "spatial_3tpt").placement) @ T
    values = {f"constraint.t{axis}": value for axis, value in zip("xyz", carrier[:3, 3], strict=True)}
    turns = carrier[:3, :3] @ joint("platform", "spatial_3tpt").placement[:3, :3].T
    values |= zip_angles("constraint", Rotation.from_matrix(turns).as_euler("XYZ"), "xyz")
    lengths, base = legs.lengths(T), legs.base_angles(T)
    for i, leg in enumerate(legs.legs):
        values |= zip_angles(f"base_{i + 1}", base[i], "yz")
        values[f"drive_{i + 1}.tx"] = lengths[i] - config.bodies[f"leg_{i + 1}"].length
        along = leg.base_mount @ Rotation.from_euler("YZ", base[i]).as_matrix()
        ball = (along @ joint(f"ball_{i + 1}", "spatial_3tpt").placement[:3, :3]).T @ T[:3, :3]
        values |= zip_angles(f"ball_{i + 1}", Rotation.from_matrix(ball).as_euler("XYZ"), "xyz")
    return {name: float(value) for name, value in values.items()}


def zip_angles(name: str, angles: Array, axes: str) -> Values:
    return {f"{name}.r{axis}": float(angle) for axis, angle in zip(axes, angles, strict=True)}


@pytest.mark.parametrize("seed", range(POSES))
def test_telescopic_legs_equal_their_bodies(seed: int) -> None:
    """The platform may turn, too; then its constraint springs are strained."""
    rng, legs = np.random.default_rng(seed), telescopic_legs()
    turn = Rotation.from_rotvec(rng.uniform(-0.2, 0.2, 3) * (seed % 2)).as_matrix()
    T = transform(turn, rng.uniform([-0.05, -0.05, -0.40], [0.1, 0.1, -0.32]))
    tool = described("spatial_3tpt").bodies["platform"].nodes["tool"]
    check("spatial_3tpt", telescopic_values(legs, T), shifted(T, tool), CLOSED)
    np.testing.assert_allclose(legs.position(legs.lengths(T), turn, -1), T[:3, 3], atol=CLOSED)


@pytest.mark.parametrize("seed", range(5))
def test_platform_on_telescopic_legs_rests_where_the_spheres_meet(seed: int) -> None:
    legs, reduced = telescopic_legs(), tree("spatial_3tpt")
    config = described("spatial_3tpt")
    drives = np.random.default_rng(seed).uniform(-0.02, 0.02, 3)
    lengths = drives + [config.bodies[f"leg_{i}"].length for i in (1, 2, 3)]
    T = transform(np.eye(3), legs.position(lengths, np.eye(3), -1))
    tool = shifted(T, config.bodies["platform"].nodes["tool"])
    found = reduced.tip_pose(find_equilibrium(reduced, drives)[0])
    np.testing.assert_allclose(found, tool, atol=1e-9)  # loops at rest are closed to 1e-10, six rows each


def test_named_poses_of_the_telescopic_legs_are_those_of_the_description() -> None:
    offset = np.array([0.06, 0.06, 0.0]) / np.sqrt(2.0)  # seed 001: towards 45 deg
    meant = {
        "home": offset,
        "lateral": offset + np.array([-0.04, 0.04, 0.0]) / np.sqrt(2.0),
        "centre": np.zeros(3),
    }
    legs, config = telescopic_legs(), described("spatial_3tpt")
    for label, drives in named_poses("spatial_3tpt"):
        T = transform(np.eye(3), meant[label] + [0.0, 0.0, -0.36])
        lengths = drives + [config.bodies[f"leg_{i}"].length for i in (1, 2, 3)]
        np.testing.assert_allclose(legs.lengths(T), lengths, atol=1e-10)  # printed to 10 pm
