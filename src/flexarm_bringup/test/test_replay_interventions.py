"""A run in which a sensor was switched off and a noise was changed, replayed from its bag: equal outputs."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag
from flexarm_bringup.bags.bag_writer import BagWriter
from flexarm_bringup.topics import NAMESPACE, streams

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.consistency.recording import open_recording, run_estimator  # noqa: E402
from flexarm_bringup.conversions import serialise  # noqa: E402
from flexarm_bringup.provenance import provenance  # noqa: E402
from flexarm_bringup.replaying.replay_bag import replay  # noqa: E402
from flexarm_bringup.sim.conversions import joint_state_msg, samples_to_msgs  # noqa: E402
from flexarm_bringup.sim.drives import Drives  # noqa: E402
from flexarm_estimator.exchange import EstimatorExchange  # noqa: E402
from flexarm_estimator.interventions.intervention import Intervention  # noqa: E402
from flexarm_estimator.interventions.set_noise import SetNoise  # noqa: E402
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor  # noqa: E402
from flexarm_estimator.settings import EstimatorConfig  # noqa: E402
from flexarm_model.conversions import model_to_msg  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

EPOCH_NS = 1_700_000_000_000_000_000
TICKS = 60
DONE: dict[int, list[Intervention]] = {
    20: [ToggleSensor("root_strain", False), SetNoise("encoder", (1e-3,))],
    40: [ToggleSensor("root_strain", True), SetNoise("modal_force", (0.5,))],
}


def record_run(folder: Path, done: dict[int, list[Intervention]], is_late: bool) -> Bag:
    """Record the node's part of a run in real time; a late recorder hears of interventions last."""
    path = find_manipulator("single_link")
    config = load_config(path, "geared")
    drives = Drives(config)
    exchange = EstimatorExchange(config, EstimatorConfig(), None)
    written = streams(["tip_accelerometer"])
    types = {stream.topic: stream.type for stream in written}
    kept: list[tuple[str, int, bytes]] = []

    def keep(topic: str, msg: Any, now_ns: int) -> None:
        kept.append((f"{NAMESPACE}/{topic}", now_ns, serialise(msg, types[topic])))

    model = model_to_msg(linearize(ReducedTree(config)))
    exchange.on_model(model)
    keep("model", model, EPOCH_NS)
    samples = drives.observe()
    rng = np.random.default_rng(7)
    for k in range(TICKS):
        now_ns = EPOCH_NS + k * drives.rig.period_ns
        told = samples_to_msgs(config, samples, lambda tick: EPOCH_NS + tick * drives.rig.period_ns)
        for topic, msg in [
            *((out.topic, out.msg) for out in told),
            ("joint_states", joint_state_msg(drives, now_ns)),
        ]:
            keep(topic, msg, now_ns)
            exchange.on_sensor(topic, msg)
        for out in exchange.step(now_ns):
            keep(out.topic, out.msg, now_ns)
        for intervention in done.get(k, ()):
            for out in exchange.intervene(intervention):
                keep(out.topic, out.msg, now_ns + is_late * 50_000_000)
        drives.tau = [5.0 * float(rng.normal())]
        samples = drives.rig.step(np.array(drives.tau))
        drives.motors.update(samples)
    with BagWriter(folder, written, provenance("single_link", path, "geared", json.dumps({}))) as writer:
        for name, log_time_ns, cdr in sorted(kept, key=lambda item: item[1]):
            writer.write(name, log_time_ns, cdr)
    return check_bag(folder)


def states(bag: Bag) -> list[Record]:
    return [record for record in bag.records if record.name == f"{NAMESPACE}/modal_state"]


@pytest.mark.parametrize("is_late", [pytest.param(False, marks=pytest.mark.slow), True])
def test_a_replay_does_again_what_a_user_did(tmp_path: Path, is_late: bool) -> None:
    bag = record_run(tmp_path / "run", DONE, is_late)
    again = replay(bag, tmp_path / "replayed")
    assert [record.cdr for record in states(again)] == [record.cdr for record in states(bag)]


@pytest.mark.slow
def test_a_replay_without_the_interventions_differs(tmp_path: Path) -> None:
    done, not_done = (record_run(tmp_path / name, what, False) for name, what in (("a", DONE), ("b", {})))
    pairs = [(a.cdr, b.cdr) for a, b in zip(states(done), states(not_done), strict=True)]
    assert [a == b for a, b in pairs].index(False) == 21


def test_an_ablated_sensor_stays_out_also_where_its_user_switched_it_on_again(tmp_path: Path) -> None:
    """It was fused from then on, and the row still said "left out"."""
    record_run(tmp_path / "run", DONE, is_late=False)
    recording = open_recording(tmp_path / "run")
    for off in ((), ("root_strain",)):
        last = run_estimator(recording, off)[-1].estimate
        accepted = next(report.accepted for report in last.sensors if report.name == "root_strain")
        assert bool(accepted) != bool(off)
