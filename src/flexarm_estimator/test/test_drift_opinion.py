"""What the drift watch reads of the estimator's states and of interventions."""

from __future__ import annotations

import pytest

interfaces = pytest.importorskip("flexarm_interfaces.msg", reason="needs ROS and flexarm_interfaces")

from flexarm_estimator.drift.opinion import OFF, Opinion  # noqa: E402
from flexarm_estimator.drift.opinion_reader import LASTING, REFUSED, OpinionReader  # noqa: E402
from flexarm_estimator.interventions.conversions import intervention_to_msg  # noqa: E402
from flexarm_estimator.interventions.reset import Reset  # noqa: E402
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor  # noqa: E402
from flexarm_model.conversions import ns_to_stamp  # noqa: E402

GAUGE = "root_strain"
HEALTH, STATE = interfaces.SensorHealth, interfaces.ModalState


def read(
    reader: OpinionReader,
    t: float,
    status: int,
    reason: str = "",
    is_degraded: bool = False,
    accepted: int = 9,
) -> Opinion:
    """Let a state of an instant [s] be read that says something of the gauge."""
    msg = STATE(status=STATE.DEGRADED if is_degraded else STATE.OK)
    msg.header.stamp = ns_to_stamp(round(1e9 * t))
    msg.sensors = [HEALTH(name=GAUGE, status=status, reason=reason, accepted=accepted)]
    reader.on_state(msg)
    return reader.opinion


def test_a_sensor_that_is_off_is_not_used_until_it_is_on_again() -> None:
    reader = OpinionReader()
    assert read(reader, 1.0, HEALTH.OFF, "switched off").unused == {GAUGE: OFF}
    assert read(reader, 1.1, HEALTH.OK) == Opinion()


def test_a_fault_lasts_a_while_and_keeps_its_first_reason() -> None:
    """A wrong scale shows in some moves and not in others."""
    reader = OpinionReader()
    read(reader, 1.0, HEALTH.FAULTY, "shifted by 1")
    assert read(reader, 2.0, HEALTH.FAULTY, "shifted by 2").unused == {GAUGE: "at fault: shifted by 1"}
    assert read(reader, 1.9 + LASTING, HEALTH.OK).unused
    assert read(reader, 2.1 + LASTING, HEALTH.OK) == Opinion()


def test_a_clock_that_is_set_back_does_not_keep_a_fault() -> None:
    reader = OpinionReader()
    read(reader, 100.0, HEALTH.FAULTY, "frozen")
    assert read(reader, 1.0, HEALTH.OK) == Opinion()


def test_a_silent_sensor_is_neither_at_fault_nor_doubted() -> None:
    assert read(OpinionReader(), 1.0, HEALTH.STALE, "silent", is_degraded=True) == Opinion()


def test_a_spike_raises_no_doubt_and_refusals_time_and_again_do() -> None:
    reader = OpinionReader()
    for k in range(REFUSED - 1):
        assert read(reader, 0.1 * k, HEALTH.REJECTED, "too far") == Opinion()
    assert read(reader, 1.0, HEALTH.REJECTED, "too far").doubted == {GAUGE: "too far"}


def test_a_remark_is_a_doubt_where_the_estimate_is_degraded_by_it() -> None:
    reader = OpinionReader()
    assert read(reader, 1.0, HEALTH.OK, "noise is 3 times", is_degraded=True).doubted == {
        GAUGE: "noise is 3 times"
    }
    assert read(OpinionReader(), 1.0, HEALTH.OK, "noise is 3 times") == Opinion()


def test_channels_are_off_until_they_are_on_whatever_becomes_of_the_estimator() -> None:
    reader = OpinionReader()
    for is_on, channels in ((False, ("x",)), (False, ("z",))):
        reader.on_intervention(intervention_to_msg(ToggleSensor(GAUGE, is_on, channels), 0))
    reader.on_intervention(intervention_to_msg(Reset(), 0))
    assert read(reader, 1.0, HEALTH.OK, "x, z switched off", is_degraded=True).channels == {GAUGE: ("x", "z")}
    assert not reader.opinion.doubted
    reader.on_intervention(intervention_to_msg(ToggleSensor(GAUGE, True, ("x",)), 0))
    assert reader.opinion.channels == {GAUGE: ("z",)}
    assert read(reader, 2.0, HEALTH.OK, accepted=1).channels == {GAUGE: ("z",)}  # one that came back


def test_the_same_again_makes_no_other_opinion() -> None:
    reader = OpinionReader()
    assert read(reader, 1.0, HEALTH.OFF) is read(reader, 2.0, HEALTH.OFF)


def test_a_state_that_does_not_fit_together_says_nothing() -> None:
    reader, msg = OpinionReader(), STATE(theta=[1.0])
    msg.sensors = [HEALTH(name=GAUGE, status=HEALTH.OFF)]
    reader.on_state(msg)
    assert reader.opinion == Opinion()
