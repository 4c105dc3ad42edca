"""Sensors on arms simple enough to say by hand what they must read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, Array, arm, bar, random_states, tree
from scipy.spatial.transform import Rotation

from flexarm_model.manipulator.body_spec import Reduction, RigidBody
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.numeric.rotation import rotation_from_rpy
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_names, output_units

RADIUS, G = 0.7, 9.81
IMU = SensorSpec("imu", "accelerometer", "rod.end", ("x", "y", "z"), np.full(3, 0.01))


def rod(axis: str = "rz", rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> ReducedTree:
    """Return a rigid rod on one axis whose frame is turned by ``rpy``, gravity downwards."""
    body = RigidBody(
        "rod", 1.0, np.zeros(3), np.eye(3), {"root": np.zeros(3), "end": np.array([RADIUS, 0, 0])}
    )
    placement = np.eye(4)
    placement[:3, :3] = rotation_from_rpy(np.array(rpy))
    joint = Joint(
        "base", NodeRef(WORLD, "root"), NodeRef("rod", "root"), placement, (Axis(axis, actuated=True),)
    )
    encoder = SensorSpec("encoder", "encoder", f"base.{axis}", ("position",), np.array([1e-5]))
    return ReducedTree(
        replace(
            arm("spatial_rigid"), bodies={"rod": body}, joints=(joint,), sensors=(encoder, IMU),
            tip=NodeRef("rod", "end"), gravity=np.array([0, 0, -G]), home=np.zeros(1),
        ),
        use_compiler=False,
    )  # fmt: skip


def read(arm_tree: ReducedTree, q: float, v: float, a: float) -> Array:
    """Return the encoder and the three accelerations."""
    return np.array(arm_tree.functions["outputs"](q, v, a, q))[:4]


def test_an_accelerometer_at_rest_feels_plus_g() -> None:
    assert read(rod(), 0.4, 0.0, 0.0) == pytest.approx([0.4, 0, 0, G], abs=1e-12)


def test_a_turning_accelerometer_feels_centripetal_and_tangential_acceleration() -> None:
    assert read(rod(), 0.4, 3.0, 5.0)[1:] == pytest.approx([-9.0 * RADIUS, 5.0 * RADIUS, G], rel=1e-12)


def test_a_tilted_accelerometer_feels_g_in_its_own_axes() -> None:
    down = rod(rpy=(np.pi / 2, 0.0, 0.0))  # its z axis lies level, so the rod turns in a vertical plane
    angle = 0.3
    assert read(down, angle, 0, 0)[1:] == pytest.approx([G * np.sin(angle), G * np.cos(angle), 0], abs=1e-12)


def test_a_sliding_accelerometer_feels_its_acceleration() -> None:
    assert read(rod("tx"), 0.2, 3.0, 5.0) == pytest.approx([0.2, 5.0, 0, G], rel=1e-12, abs=1e-12)


def test_rows_are_named_in_the_order_of_the_file_and_carry_their_unit() -> None:
    config = arm("spatial_rigid")
    names, units = output_names(config), output_units(config)
    assert names[:5] == ("slide.position", "imu.x", "imu.y", "imu.z", "camera.tx")
    assert names[-6:] == ("tip.tx", "tip.ty", "tip.tz", "tip.rx", "tip.ry", "tip.rz")
    by_name = dict(zip(names, units, strict=True))
    assert by_name["slide.position"] == "m" and by_name["imu.x"] == "m/s^2"
    assert by_name["camera.tx"] == "m" and by_name["tip.rz"] == "rad"
    assert dict(zip(output_names(arm("single_link")), output_units(arm("single_link")), strict=True))[
        "encoder.position"
    ] == "rad"  # fmt: skip


@pytest.mark.parametrize("name", ["spatial_rigid", "spatial"])
def test_pose_rows_are_the_displacement_of_the_tip_in_its_own_axes(name: str) -> None:
    arm_tree = tree(name)
    rest = np.zeros(arm_tree.n_q)
    for q_ref, step, _ in random_states(arm_tree, 5):
        q = q_ref + 1e-3 * step
        T_ref, T = arm_tree.tip_pose(q_ref), arm_tree.tip_pose(q)
        R_ref = T_ref[:3, :3]
        turn = Rotation.from_matrix(R_ref.T @ T[:3, :3]).as_rotvec()
        expected = np.concatenate([R_ref.T @ (T[:3, 3] - T_ref[:3, 3]), turn])
        y = np.array(arm_tree.functions["outputs"](q, rest, rest, q_ref))
        assert y[-6:] == pytest.approx(expected, abs=1e-8)  # sin(angle) for angle: third order
        assert y[-12:-6] == pytest.approx(y[-6:], abs=0)  # the camera watches the tip


def test_rows_of_a_planar_arm_do_not_depend_on_where_it_points() -> None:
    functions = tree("single_link").functions
    here, there = (
        tuple(np.array(part) for part in functions["output_rows"](np.array([a, 0, 0, 0]))) for a in (0, 1)
    )
    for one, other in zip(here[1:], there[1:], strict=True):
        assert one == pytest.approx(other, abs=1e-9)


GAUGES = [("bend_y", (0.002, 0.0), BAR.I_z, 0.002), ("bend_z", (0.0, 0.005), BAR.I_y, 0.005)]


@pytest.mark.parametrize(("kind", "offset", "second", "lever"), GAUGES)
def test_a_gauge_reads_the_strain_of_a_beam_under_a_tip_load(
    kind: str, offset: tuple[float, float], second: float, lever: float
) -> None:
    """-y P (L - x) / E I: a load towards the gauge's side compresses it."""
    gauge = SensorSpec("gauge", "strain_gauge", "bar.gauge", ("strain",), np.array([1e-6]), offset=offset)
    arm_tree = ReducedTree(clamped_bar(kind, gauge), use_compiler=False)
    load = 2.0  # [N] at the tip, along the direction of bending
    eta = np.linalg.solve(
        arm_tree.bodies["bar"].K, load * arm_tree.bodies["bar"].nodes["end"].Phi.sum(axis=0)
    )
    strain = np.array(arm_tree.functions["outputs"](eta, 0 * eta, 0 * eta, eta))[0]
    assert strain == pytest.approx(-lever * load * (BAR.length - 0.1) / (BAR.E * second), rel=1e-9)


def clamped_bar(kind: str, gauge: SensorSpec) -> ManipulatorConfig:
    beam = replace(
        bar([kind]),
        nodes={"root": 0.0, "gauge": 0.1, "end": BAR.length},
        reduction=Reduction("craig_bampton", 4, "clamped", ("end",)),  # exact under loads on its end
    )
    weld = Joint("weld", NodeRef(WORLD, "root"), NodeRef("bar", "root"), np.eye(4), ())
    return replace(
        arm("planar"), bodies={"bar": beam}, joints=(weld,), sensors=(gauge,), tip=NodeRef("bar", "end"),
        gravity=np.zeros(3), home=np.zeros(0),
    )  # fmt: skip


@pytest.mark.parametrize("site", ["rod.end", "world.root"])
def test_a_strain_gauge_where_nothing_strains_is_refused_by_name(site: str) -> None:
    gauge = SensorSpec("gauge", "strain_gauge", site, ("strain",), np.array([1e-6]), offset=(1e-3, 0.0))
    stiff = ReducedTree(replace(rod().config, sensors=(gauge,)), use_compiler=False)
    with pytest.raises(ValueError, match=rf"sensor 'gauge': '{site}' is rigid or .* put it on a beam"):
        _ = stiff.expressions
