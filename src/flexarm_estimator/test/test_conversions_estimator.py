"""What is converted to a message and back is the same."""

from types import SimpleNamespace

import numpy as np
import pytest
from planar_strip import StripKinematics, run, simulate, strip_model

from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_estimator.state.state_layout import StateLayout
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

pytestmark = pytest.mark.ros
conversions = pytest.importorskip("flexarm_estimator.conversions", reason="needs ROS and flexarm_interfaces")

RECORD = simulate(60, np.random.default_rng(30), camera_every=7)
ESTIMATE = run(RECORD, camera_delay=12)[-1]
STAMP_NS = 1_700_000_000_123_456_789


def test_the_state_survives_a_message_bit_for_bit():
    msg = conversions.state_to_msg(ESTIMATE, strip_model(), STAMP_NS)
    x, P, status, sensors = conversions.state_from_msg(msg)
    np.testing.assert_array_equal(x, ESTIMATE.x)
    np.testing.assert_array_equal(P, ESTIMATE.P)
    assert (status, msg.model_id, msg.reason) == (ESTIMATE.status, ESTIMATE.model_id, ESTIMATE.reason)
    assert list(msg.joint_names) == ["base.rz"]
    assert list(msg.names) == ["mode_1", "mode_2", "mode_3"]
    for before, after in zip(ESTIMATE.sensors, sensors, strict=True):
        np.testing.assert_array_equal(before.innovation, after.innovation)
        assert before._replace(innovation=None) == after._replace(innovation=None)


def test_the_controller_is_told_where_the_modes_rest():
    layout = StateLayout(4, 1, n_s=2)
    x = np.append(ESTIMATE.x[:9], [0.01, -0.02])
    sagging = ESTIMATE._replace(x=x, P=np.eye(11), layout=layout)
    assert list(conversions.state_to_msg(sagging, strip_model(), STAMP_NS).sag) == [0.01, -0.02]
    assert not conversions.state_to_msg(ESTIMATE, strip_model(), STAMP_NS).sag


def test_the_controller_is_told_what_was_learned_of_the_stiffness():
    layout = StateLayout(4, 1, n_p=1, n_learned=2)
    learning = ESTIMATE._replace(x=np.append(ESTIMATE.x[:9], -0.3), P=np.eye(10), layout=layout)
    assert list(conversions.state_to_msg(learning, strip_model(), STAMP_NS).stiffness) == [-0.3, -0.3]
    assert not conversions.state_to_msg(ESTIMATE, strip_model(), STAMP_NS).stiffness


def test_a_state_whose_lengths_do_not_fit_is_refused():
    msg = conversions.state_to_msg(ESTIMATE, strip_model(), STAMP_NS)
    msg.eta_dot = []
    with pytest.raises(ValueError, match="covariance has 81 numbers, 36 expected"):
        conversions.state_from_msg(msg)


def test_the_tip_survives_a_message():
    motion = conversions.tip_from_msg(conversions.tip_to_msg(ESTIMATE, STAMP_NS))
    np.testing.assert_allclose(motion.T_world_tip, ESTIMATE.T_world_tip, atol=1e-15)
    np.testing.assert_allclose(motion.twist, ESTIMATE.twist_tip, atol=1e-15)
    np.testing.assert_allclose(motion.cov_pose, ESTIMATE.cov_tip_pose, atol=1e-18)
    np.testing.assert_allclose(motion.cov_twist, ESTIMATE.cov_tip_twist, atol=1e-15)


def test_the_twist_of_an_odometry_is_in_the_axes_of_the_tool():
    """A strip that turns about its hub moves along its own y axis, wherever it points."""
    record = simulate(400)
    estimate = run(record)[-1]
    assert abs(estimate.theta[0]) > 0.1
    msg = conversions.tip_to_msg(estimate, STAMP_NS)
    speed = np.linalg.norm(estimate.twist_tip[:3])
    bend = StripKinematics().tip_pose(estimate.x[:4])
    assert speed > 0.1
    along = (bend[:3, :3].T @ estimate.twist_tip[:3])[1]
    assert msg.twist.twist.linear.y == pytest.approx(along)
    assert abs(msg.twist.twist.linear.x) < 0.1 * speed
    assert (msg.header.frame_id, msg.child_frame_id) == ("base", "tool")


@pytest.mark.parametrize(
    ("more", "level"), [({}, "WARN"), ({"0 efforts for 2 names": 1}, "ERROR")], ids=["alone", "and more"]
)
def test_joints_of_a_gripper_in_joint_states_are_worth_a_warning(more, level):
    """They were a lasting error, beside an arm that did all it was asked for."""
    (refusal,) = (
        SensorReader(load_config(find_manipulator("single_link")))
        .read("joint_states", SimpleNamespace(name=["gripper.jaw", "base.rz"], position=[0.1, 0.2]), 0.0)
        .refusals
    )
    refusals = {refusal.source: {**more, refusal.reason: 7}}
    status = conversions.diagnostics_msg(ESTIMATE, "", refusals, STAMP_NS).status[-1]
    assert (status.name, status.message) == ("estimator: joint_states", "unknown joint 'gripper.jaw'")
    assert status.level == getattr(conversions.DiagnosticStatus, level)


def test_unknown_joints_in_the_place_of_the_arms_own_are_an_error():
    reading = SensorReader(load_config(find_manipulator("single_link"))).read(
        "joint_states", SimpleNamespace(name=["base_rz"], position=[0.1]), 0.0
    )
    refusals = {refusal.source: {refusal.reason: 7} for refusal in reading.refusals}
    told = {each.name: each for each in conversions.diagnostics_msg(ESTIMATE, "", refusals, STAMP_NS).status}
    status = told["estimator: joint_states"]
    assert (status.message, status.level) == ("unknown joint 'base_rz'", conversions.DiagnosticStatus.ERROR)


def test_diagnostics_name_what_was_refused_with_a_count_for_every_reason():
    refusals = {
        "strain": {"unknown gauge 'y'": 2, "unknown gauge 'x'": 3},
        "camera/pose_timestamp": {"stamp is 0 ns": 1},
        "encoder": {"not finite": 4},
    }
    figures = {"camera": {"stamp delay in use [s]": 0.0125}}
    msg = conversions.diagnostics_msg(ESTIMATE, "", refusals, STAMP_NS, figures)
    by_name = {status.name: status for status in msg.status}
    assert len(by_name) == len(msg.status)
    assert by_name["estimator: state"].level == conversions.DiagnosticStatus.OK
    assert by_name["estimator: encoder"].message == "ok"
    assert values(by_name["estimator: encoder"])["refused: not finite"] == "4"
    assert values(by_name["estimator: camera"])["stamp delay in use [s]"] == "0.0125"
    assert by_name["estimator: strain"].level == conversions.DiagnosticStatus.ERROR
    assert by_name["estimator: strain"].message == "unknown gauge 'x'"
    assert values(by_name["estimator: strain"]) == {
        "refused": "5",
        "refused: unknown gauge 'y'": "2",
        "refused: unknown gauge 'x'": "3",
    }
    assert by_name["estimator: camera/pose_timestamp"].level == conversions.DiagnosticStatus.WARN
    nothing = conversions.diagnostics_msg(None, "no model yet", {}, STAMP_NS)
    assert nothing.status[0].level == conversions.DiagnosticStatus.ERROR
    assert nothing.status[0].message == "no model yet"


def values(status):
    return {pair.key: pair.value for pair in status.values}
