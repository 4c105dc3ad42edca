"""A move under the nonlinear law, replayed from its bag: the settings that only this law has count too."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_writer import BagWriter
from flexarm_bringup.topics import NAMESPACE, streams

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_interfaces.msg import GuardStatus  # noqa: E402

from flexarm_bringup.conversions import serialise  # noqa: E402
from flexarm_bringup.provenance import provenance  # noqa: E402
from flexarm_bringup.replaying.replay_bag import replay  # noqa: E402
from flexarm_bringup.sim.conversions import joint_state_msg, samples_to_msgs  # noqa: E402
from flexarm_bringup.sim.drives import Drives  # noqa: E402
from flexarm_controller.conversions import reference_to_msg  # noqa: E402
from flexarm_controller.exchange import ControllerExchange  # noqa: E402
from flexarm_controller.nonlinear.settings import NmpcConfig  # noqa: E402
from flexarm_controller.reference import Reference  # noqa: E402
from flexarm_controller.settings import ControllerConfig, MpcConfig  # noqa: E402
from flexarm_controller.time_budget import Clocks  # noqa: E402
from flexarm_estimator.exchange import EstimatorExchange  # noqa: E402
from flexarm_estimator.settings import EstimatorConfig  # noqa: E402
from flexarm_model.conversions import model_to_msg  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

EPOCH_NS = 1_700_000_000_000_000_000
PERIODS = 40
COMMANDS = f"{NAMESPACE}/joint_commands"
STEP = Reference(np.array([0.03, 0.13]), np.array([[0.0], [0.3]]), np.zeros((2, 1)), np.zeros((2, 1)))


def record_move(folder: Path, iterations: int, told: dict[str, Any]) -> Bag:
    """Record a move in real time, made with so many iterations, and the settings that the bag tells."""
    path = find_manipulator("single_link")
    config = load_config(path, "geared")
    drives = Drives(config)
    written = streams(["tip_accelerometer"])
    types = {stream.topic: stream.type for stream in written}
    kept: list[tuple[str, int, bytes]] = []

    def keep(topic: str, msg: Any, now_ns: int) -> Any:
        kept.append((f"{NAMESPACE}/{topic}", now_ns, serialise(msg, types[topic])))
        return msg

    estimator = EstimatorExchange(config, EstimatorConfig(), None)
    controller = ControllerExchange(
        config, ControllerConfig(law="nmpc"), MpcConfig(time_limit=1.0), None, Clocks(cpu=lambda: 0.0),
        nmpc=NmpcConfig(sqp_iterations=iterations),
    )  # fmt: skip
    model = keep("model", model_to_msg(linearize(ReducedTree(config))), EPOCH_NS)
    estimator.on_model(model)
    controller.on_model(model)
    controller.on_guard_status(keep("guard_status", GuardStatus(session_token=5), EPOCH_NS))
    samples = drives.observe()
    for k in range(PERIODS):
        now_ns = EPOCH_NS + k * drives.rig.period_ns
        if k == 2:
            move = reference_to_msg(STEP, tuple(config.actuated), EPOCH_NS)
            controller.on_reference(keep("reference", move, now_ns))
        sensed = samples_to_msgs(config, samples, lambda tick: EPOCH_NS + tick * drives.rig.period_ns)
        for topic, msg in [
            *((out.topic, out.msg) for out in sensed),
            ("joint_states", joint_state_msg(drives, now_ns)),
        ]:
            estimator.on_sensor(topic, keep(topic, msg, now_ns))
        for out in estimator.step(now_ns):
            keep(out.topic, out.msg, now_ns)
            for answer in controller.on_modal_state(out.msg) if out.topic == "modal_state" else ():
                keep(answer.topic, answer.msg, now_ns)
                drives.tau = list(answer.msg.effort) if answer.topic == "joint_commands" else drives.tau
        controller.work_ahead()
        samples = drives.rig.step(np.array(drives.tau))
        drives.motors.update(samples)
    with BagWriter(folder, written, provenance("single_link", path, "geared", json.dumps(told))) as writer:
        for name, log_time_ns, cdr in sorted(kept, key=lambda item: item[1]):
            writer.write(name, log_time_ns, cdr)
    return check_bag(folder)


def commands(bag: Bag) -> list[bytes]:
    return [record.cdr for record in bag.records if record.name == COMMANDS]


def test_a_replay_takes_the_settings_of_the_nonlinear_law_from_the_bag(tmp_path: Path) -> None:
    told = {"controller": {"law": "nmpc", "sqp_iterations": 5}}
    bag = record_move(tmp_path / "run", 5, told)
    assert len(commands(bag)) == PERIODS
    assert commands(replay(bag, tmp_path / "replayed")) == commands(bag)


def test_a_replay_with_another_number_of_iterations_differs(tmp_path: Path) -> None:
    bag = record_move(tmp_path / "run", 5, {"controller": {"law": "nmpc"}})
    assert commands(replay(bag, tmp_path / "replayed")) != commands(bag)
