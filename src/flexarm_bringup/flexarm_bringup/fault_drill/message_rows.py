"""Rows about messages: frames and joints nobody knows, wrong sizes, odd covariances, missing stamps."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from flexarm_bringup.fault_drill.findings import Finding, is_finite
from flexarm_bringup.fault_drill.row import Row, together
from flexarm_bringup.fault_drill.spoilt_messages import SPOIL, STRANGE
from flexarm_bringup.fault_drill.stand import FAULT_START, Skipped, Stand

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.message_stand import Tamper
    from flexarm_bringup.sim.conversions import Outgoing

TOLD_AFTER = 1.0  # s
CASES = 10_000
SEED = 19
TORQUE = "applied_effort"
DRIVES = ("joint_states", TORQUE)  # topics
IN_FLIGHT = 3  # ticks before the end whose frames may still be on their way
KINDS = {"joint_states": "encoder", "strain": "strain_gauge", "imu": "accelerometer", "camera": "camera"}


def wrong_frames(topic: str, kind: str, spoil: Callable[[Any], None]) -> Callable[[Stand], list[Finding]]:
    """Return what spoils all messages of a topic that starts with ``topic``."""

    def play(stand: Stand) -> list[Finding]:
        """Play the messages with those of the topic spoilt; nothing where the machine has no such sensor."""
        if not stand.of_kind(kind):
            return []
        bench, first = stand.messages, round(FAULT_START / stand.record.dt)
        told = FAULT_START + TOLD_AFTER

        def tamper(k: int, messages: list[Outgoing]) -> list[Outgoing]:
            """Spoil the messages of the topic."""
            for out in messages if k >= first else ():
                if out.topic.startswith(topic):
                    spoil(out.msg)
            return messages

        trace = bench.play(tamper, told)
        fused = sum(
            trace.accepted(-1, s.name) - trace.accepted(first - 1, s.name) for s in stand.of_kind(kind)
        )
        errors = [text for text in trace.diagnostics.get(b"\x02", []) if STRANGE in text]
        return [
            Finding(f"{kind}: fused", fused, 0),
            Finding(f"{kind}: errors naming it after 1 s", len(errors), 1, at_least=True),
        ]

    return play


def fuzz(stand: Stand) -> list[Finding]:
    """Send ten thousand spoilt messages beside the good ones, then only those that are certainly bad.

    What was sent on a topic of which only the newest message is taken need not all be refused: a good one
    may have come after it. None of it may be fused: of those that are certainly bad no estimate may know.
    """
    bench, each = stand.messages, math.ceil(CASES / (len(stand.record.t) - 1))
    sent: dict[str, list[bool]] = {topic: [] for topic in SPOIL}
    trace, sensors = bench.play(_spoiling(each, sent), FAULT_START), _names_by_topic(stand)
    least = min(
        trace.refused(topic, sensors[topic]) / sum(bad)
        for topic, bad in sent.items()
        if sum(bad) and topic not in trace.newest_only
    )
    fused = max(trace.accepted(-1, name) for name in sensors["joint_states"]) - len(stand.record.t)
    findings = [
        Finding("spoilt messages", sum(map(len, sent.values())), CASES, at_least=True),
        Finding("non-finite estimates", sum(not is_finite(e) for e in trace.estimates), 0),
        Finding("refused / certainly bad, least of a topic", least, 1.0, at_least=True),
        Finding("encoder samples fused beside the good ones", fused, 0),
    ]
    if trace.newest_only:  # which of several is the newest when it is looked at differs from run to run
        return findings
    sound = bench.play(lambda k, messages: messages, FAULT_START).estimates
    beside = bench.play(_spoiling(each, {topic: [] for topic in SPOIL}, only_bad=True), FAULT_START).estimates
    changed = sum(not np.array_equal(one.x, other.x) for one, other in zip(sound, beside, strict=True))
    return [*findings, Finding("estimates changed by what is certainly bad", changed, 0)]


def _spoiling(each: int, sent: dict[str, list[bool]], only_bad: bool = False) -> Tamper:
    """Return what adds spoilt copies of what sensors say.

    Args:
        each: Of every period.
        sent: Takes whether each is certainly bad, by topic.
        only_bad: Add no others.
    """
    rng = np.random.default_rng(SEED)

    def tamper(k: int, messages: list[Outgoing]) -> list[Outgoing]:
        """Add them before the good ones."""
        bad, said = [], [out for out in messages if out.topic != TORQUE]
        for _ in range(each):
            out = copy.deepcopy(said[rng.integers(len(said))])
            topic = out.topic.split("/")[0]
            sent[topic].append(SPOIL[topic](out.msg, rng))
            if sent[topic][-1] or not only_bad:
                bad.append(out)
        return [*bad, *messages]

    return tamper


def _names_by_topic(stand: Stand) -> dict[str, set[str]]:
    """Return the sensors that the topics of SPOIL tell of."""
    return {topic: {spec.name for spec in stand.of_kind(kind)} for topic, kind in KINDS.items()}


def odd_covariances(stand: Stand) -> list[Finding]:
    """Let every camera frame have a covariance that cannot be used."""
    bench = stand.messages
    odd = [np.zeros(36), -np.eye(6).ravel(), np.full(36, math.nan), np.full(36, math.inf)]

    def tamper(k: int, messages: list[Outgoing]) -> list[Outgoing]:
        """Give the camera odd covariances."""
        for out in messages:
            if out.topic.startswith("camera"):
                out.msg.pose.covariance = odd[k % len(odd)]
        return messages

    trace, names = bench.play(tamper, FAULT_START), [spec.name for spec in stand.of_kind("camera")]
    usual = sum(stand.nominal.report(-IN_FLIGHT, name).accepted for name in names)
    lost = usual - sum(trace.accepted(-1, name) for name in names)
    return [Finding("frames lost by an odd covariance", lost, 0)]


def missing_fields(stand: Stand) -> list[Finding]:
    """Leave velocity and effort of the joint states empty, as real robots do."""
    bench = stand.messages

    def tamper(k: int, messages: list[Outgoing]) -> list[Outgoing]:
        """Leave out what drivers may leave out."""
        for out in messages:
            if out.topic == "joint_states":
                out.msg.velocity, out.msg.effort = [], []
        return messages

    trace, names = bench.play(tamper, FAULT_START), [spec.name for spec in stand.of_kind("encoder")]
    lost = len(names) * len(stand.record.t) - sum(trace.accepted(-1, name) for name in names)
    return [Finding("encoder samples lost by an empty effort", lost, 0.001 * len(stand.record.t))]


def no_stamps(stand: Stand) -> list[Finding]:
    """Leave the stamp of every gauge, accelerometer and camera at zero."""
    if not (specs := stand.of_kind("strain_gauge", "accelerometer", "camera")):
        raise Skipped("the machine has no such sensor")
    bench, first = stand.messages, round(FAULT_START / stand.record.dt)
    spoilt: set[str] = set()

    def tamper(k: int, messages: list[Outgoing]) -> list[Outgoing]:
        """Take the stamps away."""
        for out in messages if k >= first else ():
            if out.topic not in DRIVES:
                out.msg.header.stamp.sec = out.msg.header.stamp.nanosec = 0
                spoilt.add(out.topic)
        return messages

    trace = bench.play(tamper, FAULT_START + TOLD_AFTER)
    fused = sum(trace.accepted(-1, s.name) - trace.accepted(first - 1, s.name) for s in specs)
    warnings = " ".join(trace.diagnostics.get(b"\x01", []))
    unnamed = [topic for topic in spoilt if f"{topic}_timestamp" not in warnings]
    return [
        Finding("samples without a stamp fused", fused, 0),
        Finding("topics without a warning after 1 s", len(unnamed), 0),
    ]


def _rename_frame(msg: Any) -> None:
    msg.header.frame_id = STRANGE


def _rename_joints(msg: Any) -> None:
    msg.name = [STRANGE for _ in msg.name]


ROWS = (
    Row(
        18,
        "frame or joint that nobody knows",
        "nothing fused; an ERROR names it",
        together(
            wrong_frames("camera", "camera", _rename_frame),
            wrong_frames("imu", "accelerometer", _rename_frame),
            wrong_frames("joint_states", "encoder", _rename_joints),
        ),
    ),
    Row(
        19,
        "wrong sizes, empty fields, no quaternion, odd covariances",
        "no exception; refused and counted; missing fields ignored; R floored",
        together(fuzz, odd_covariances, missing_fields),
    ),
    Row(21, "stamp of zero", "dropped; a WARN names the topic", no_stamps),
)
