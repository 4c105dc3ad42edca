"""The drift watch on messages of the rig and the estimator: a fault of a sensor is not the arm's."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS")

from drift_wire import Wire  # noqa: E402

from flexarm_bringup.bags.bag_reader import Bag, Record  # noqa: E402
from flexarm_bringup.conversions import serialise  # noqa: E402
from flexarm_bringup.drift_run.bag import JUDGED_ANEW, UNJUDGED, watch_bag, watch_messages  # noqa: E402
from flexarm_bringup.drift_run.command import build_page  # noqa: E402
from flexarm_bringup.drift_run.simulation import Watched  # noqa: E402
from flexarm_bringup.provenance import provenance  # noqa: E402
from flexarm_bringup.tasks.node_settings import node_settings  # noqa: E402
from flexarm_bringup.tasks.task import find_task, load_task  # noqa: E402
from flexarm_bringup.topics import find_stream  # noqa: E402
from flexarm_estimator.drift.settings import DriftConfig  # noqa: E402
from flexarm_estimator.exchange import EstimatorExchange  # noqa: E402
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor  # noqa: E402
from flexarm_model.conversions import stamp_to_ns  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402

WRONG = "root_strain: wrong factor 0.6"


def watched(wire: Wire) -> Watched:
    told = watch_messages(wire.said, wire.config, wire.estimator)
    for mode in told.modes[-1]:
        print(f"{mode.name}: {100 * mode.drift:+.2f} +- {100 * mode.drift_sigma:.2f} % at {told.t[-1]:.1f} s")
    print(*told.sensors, *told.alarms, told.proposal, sep="\n")
    return told


def without_states(wire: Wire) -> Bag:
    """Return a bag of all but what the estimator said."""
    records, now_ns = list[Record](), 0
    for name, msg in wire.said:
        stream = find_stream(name)
        assert stream is not None
        now_ns = max(now_ns, stamp_to_ns(msg.header.stamp))
        if stream.publisher != "estimator":
            records.append(Record(name, stream.type, now_ns, serialise(msg, stream.type)))
    settings = json.dumps(node_settings(load_task(find_task("single_link")), "geared"))
    custom = provenance("single_link", find_manipulator("single_link"), "geared", settings)
    return Bag(Path("wire"), tuple(records), Counter(record.name for record in records), custom)


@pytest.mark.slow
def test_a_wrong_gauge_is_not_read_as_a_changed_arm_in_a_bag_without_the_estimators_word() -> None:
    """Mode 1 was told to have a damping of nothing, mode 2 to run at -15 %, and the arm was blamed."""
    told = watch_bag(without_states(Wire("root_strain: wrong factor 0.85", 25.0)), DriftConfig())
    assert not told.alarms and not told.proposal
    assert any("root_strain (at fault" in said for _, said in told.sensors)
    assert abs(told.modes[-1][0].change) < 0.01


def test_a_bag_without_the_estimators_word_says_who_judged_its_sensors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bag = without_states(Wire("root_strain: stuck", 2.5))
    told = watch_bag(bag, DriftConfig())
    page = build_page("", told, DriftConfig(), [])
    assert page.remarks["Sensors"][0] == JUDGED_ANEW
    assert "root_strain (at fault: frozen" in page.remarks["Sensors"][-1]
    monkeypatch.setattr(EstimatorExchange, "step", lambda *_: [])
    assert watch_bag(bag, DriftConfig()).judged == UNJUDGED


@pytest.mark.slow
@pytest.mark.parametrize("done", [(ToggleSensor("root_strain", False),), ()])
def test_a_wrong_gauge_that_is_switched_off_or_found_out_does_not_read_as_another_stiffness(
    done: tuple[ToggleSensor, ...],
) -> None:
    """Without the estimator's word mode 1 was told to run at +26 %."""
    told = watched(Wire(WRONG, 20.0, *done))
    assert not told.alarms and told.sensors[-1][1].startswith("goes on without root_strain")
    for mode in told.modes[-1]:
        assert mode.is_certain and abs(mode.change) < 0.01


@pytest.mark.slow
def test_a_real_change_puts_no_sensor_in_doubt() -> None:
    told = watched(Wire("", 20.0, scale=0.8))
    assert not told.sensors and "as if all stiffness were 0.6" in told.proposal


def test_a_sensor_that_is_silent_from_the_start_is_named() -> None:
    """The length of the bag was blamed."""
    wire = Wire("root_strain: off", 2.5)
    told = watched(wire)
    page = build_page("", told, DriftConfig(), [])
    assert told.modes and page.remarks["Sensors"][0].endswith("goes on without root_strain (silent)")


def test_a_bag_too_short_to_watch_names_who_was_silent() -> None:
    wire = Wire("root_strain: off", 2.5)
    wire.said = wire.said[:600]
    with pytest.raises(ValueError, match=r"no mode is running after .* without root_strain \(silent\)"):
        watched(wire)


def test_a_bag_in_which_no_sensor_says_a_number_is_not_called_short() -> None:
    wire = Wire("root_strain: off; tip_accelerometer: off", 4.0)
    for _, msg in (item for item in wire.said if item[0].endswith("joint_states")):
        msg.position = [float("nan")]
    with pytest.raises(ValueError, match="in no period torque and sensors were all told"):
        watched(wire)
