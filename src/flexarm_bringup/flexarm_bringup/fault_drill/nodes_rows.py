"""Rows of the estimator once more, with nodes: the same faults and bounds, at the other end of DDS."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from flexarm_bringup.fault_drill import message_rows, sample_rows, time_rows
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.frame_rows import LATE
from flexarm_bringup.fault_drill.live_sensor_rows import ALL, BLIND, LOST, SAFE, jump, silent
from flexarm_bringup.fault_drill.row import Row, cases
from flexarm_bringup.fault_drill.system_stand import SystemStand

INJECTED_BY_THE_RIG = (1, 2, 3, 4, 12)
SENT_AS_MESSAGES = (18, 19, 21)


def on_nodes(row: Row) -> Row:
    """Return a row whose faults the rig node injects."""

    def play(stand: SystemStand) -> Sequence[Finding]:
        """Play the row on the nodes."""
        return row.play(stand.nodes)

    return replace(row, play=play, kind="N")


def on_live_estimator(row: Row) -> Row:
    """Return a row whose messages go to an estimator node."""

    def play(stand: SystemStand) -> Sequence[Finding]:
        """Play the row on nodes that run by the clock."""
        with stand.live() as live:
            return row.play(live)

    return replace(row, play=play, kind="N")


def in_a_motion(row: Row, play: Callable[[SystemStand], Sequence[Finding]]) -> Row:
    """Return a row that also looks at how the same fault ends a motion of the whole graph."""
    return replace(row, play=lambda stand: [*row.play(stand), *play(stand)])


_KNOWN = {row.number: row for row in (*sample_rows.ROWS, *message_rows.ROWS, *time_rows.ROWS)}
ROWS = (
    *(on_nodes(_KNOWN[number]) for number in INJECTED_BY_THE_RIG),
    in_a_motion(on_nodes(_KNOWN[5]), silent(BLIND, LOST)),
    Row(6, "all sensors off in a motion", "the motion ends; torque within its rate", silent(ALL, SAFE), "N"),
    *(on_live_estimator(_KNOWN[number]) for number in SENT_AS_MESSAGES),
    in_a_motion(on_live_estimator(_KNOWN[22]), jump(-50.0)),
    in_a_motion(on_live_estimator(_KNOWN[23]), jump(100.0)),
    on_nodes(Row(28, "camera frames of 30, 60 and 100 ms age", "fused at their own time", cases(*LATE))),
)
