"""A real mobile robot's bag through the estimator of an arm: nothing breaks, and what is ignored is told."""

import json
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_reader import Bag, check_bag, decode
from flexarm_bringup.bags.bag_writer import BagError

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.bags.foreign_bag import feed_bag, read_remaps  # noqa: E402
from flexarm_bringup.conversions import deserialise  # noqa: E402
from flexarm_estimator.exchange import EstimatorExchange  # noqa: E402
from flexarm_estimator.settings import EstimatorConfig  # noqa: E402
from flexarm_model.conversions import model_to_msg, stamp_to_ns  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

ROBOT = Path(__file__).parents[3] / "tests" / "recorded" / "mobile_robot"
STRANGERS = "unknown joints 'wheel_left_joint', 'wheel_right_joint'"
REMAPS = ("--remap", "/joint_states:=joint_states", "--remap", "/imu:=imu/tip_accelerometer")


@pytest.fixture(scope="module")
def bag() -> Bag:
    return check_bag(ROBOT)


def test_the_cut_has_what_makes_it_instructive(bag: Bag) -> None:
    joints = [(r.log_time_ns, decode(r)) for r in bag.records if r.name == "/joint_states"]
    imus = [decode(r) for r in bag.records if r.name == "/imu"]
    assert all(len(msg.velocity) == len(msg.effort) == 0 for _, msg in joints)
    assert max(stamp_to_ns(msg.header.stamp) - at for at, msg in joints) > 20_000_000
    assert abs(np.mean([msg.linear_acceleration.z for msg in imus])) < 0.1


def test_what_an_arm_cannot_use_of_a_mobile_robot_is_told_with_counts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "report.json"
    assert cli.main(["replay", str(ROBOT), *REMAPS, "--preset", "geared", "--json", str(report)]) == 0
    assert STRANGERS in capsys.readouterr().out
    result = json.loads(report.read_text())
    assert result["ignored"] == {
        "joint_states": {STRANGERS: 120},
        "encoder": {"no joint 'base.rz' in joint_states": 120},
        "tip_accelerometer": {"frame 'base_footprint' is not 'strip.sensor'": 98},
    }
    assert result["estimates"] == {"starting": 120}


def test_its_messages_under_the_arms_names_are_used_as_far_as_they_are_possible(bag: Bag) -> None:
    """Empty velocities and efforts do no harm; what is ahead of the clock or out of range is refused."""
    config = load_config(find_manipulator("single_link"), "geared")
    exchange = EstimatorExchange(config, EstimatorConfig(), None)
    exchange.on_model(model_to_msg(linearize(ReducedTree(config))))
    for record in bag.records:
        msg = deserialise(record.cdr, record.type)
        if record.name == "/imu":
            msg.header.frame_id = "strip.sensor"
            exchange.on_sensor("imu/tip_accelerometer", msg)
            continue
        msg.name = ["base.rz" if "left" in name else name for name in msg.name]
        exchange.on_sensor("joint_states", msg)
        assert exchange.step(stamp_to_ns(msg.header.stamp))
        assert exchange.estimate is not None
        assert np.isfinite(exchange.estimate.x).all()
    assert exchange.estimate is not None
    health = {report.name: report for report in exchange.estimate.sensors}
    assert health["encoder"].accepted + health["encoder"].rejected == 120
    assert health["tip_accelerometer"].accepted + health["tip_accelerometer"].rejected >= 97
    assert health["tip_accelerometer"].accepted > 50
    assert "unknown joint 'wheel_right_joint'" in exchange.refusals()["joint_states"]


@pytest.mark.parametrize(
    ("remap", "reason"),
    [
        ("/joint_states=joint_states", "is not FROM:=TO"),
        ("/odom:=joint_states", "no message on /odom; it has /imu, /joint_states"),
        ("/imu:=gyro", "the estimator reads no 'gyro'; allowed: joint_states, strain"),
        (
            "/imu:=strain",
            "/imu has type sensor_msgs/msg/Imu, strain needs flexarm_interfaces/msg/StrainArray",
        ),
    ],
)
def test_a_topic_that_cannot_be_fed_is_refused_by_name(bag: Bag, remap: str, reason: str) -> None:
    config = load_config(find_manipulator("single_link"), "geared")
    with pytest.raises(BagError, match=reason):
        feed_bag(bag, read_remaps([remap]), config, EstimatorConfig())
