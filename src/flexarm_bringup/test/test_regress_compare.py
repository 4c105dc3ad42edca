"""A replay is compared with its golden bag to the last message, and what an update does is told whole."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from bag_fixture import PERIOD_NS, modal_state, write_bag

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.bags.bag_reader import Bag, check_bag, decode  # noqa: E402
from flexarm_bringup.bags.bag_types import bag_types  # noqa: E402
from flexarm_bringup.regress.case import Case  # noqa: E402
from flexarm_bringup.regress.drift import Moved, find_moved  # noqa: E402
from flexarm_bringup.regress.judge import Opened, compare  # noqa: E402
from flexarm_bringup.regress.making import Renewal  # noqa: E402
from flexarm_bringup.regress.page import moved_table, renewal_tables  # noqa: E402
from flexarm_bringup.regress.pinned import pin  # noqa: E402
from flexarm_bringup.regress.playing import Played  # noqa: E402
from flexarm_bringup.replaying.compare import TOLERANCES, Comparison  # noqa: E402

MODAL = "/flexarm/modal_state"
TICKS = 20
LAST_NS = (TICKS - 1) * PERIOD_NS


@pytest.fixture
def golden(tmp_path: Path) -> Bag:
    return check_bag(write_bag(tmp_path / "golden", TICKS))


def compared(golden: Bag, played: Bag) -> Comparison:
    """Compare a bag that was played with the golden one of a case."""
    pinned = pin(golden)
    case = Case(golden.path.parent, "", pinned, pinned, TOLERANCES)
    return compare(Opened(case, golden, golden), Played(played, {}))


def with_last(bag: Bag, *states: bytes) -> Bag:
    """Return a bag with other messages instead of its last state."""
    before, last = bag.records[:-1], bag.records[-1]
    assert (last.name, last.log_time_ns) == (MODAL, LAST_NS)
    records = (*before, *(replace(last, cdr=state) for state in states))
    return replace(bag, records=records, counts={**bag.counts, MODAL: TICKS - 1 + len(states)})


def test_the_last_state_with_another_stamp_and_another_number_is_named(golden: Bag) -> None:
    late = with_last(golden, modal_state(LAST_NS + 7_000_000, eta=[5.0, 2e-3]))
    found = [(item.stamp_ns, item.topic, item.text) for item in compared(golden, late).divergences]
    assert found == [
        (LAST_NS, MODAL, "1 message(s) missing"),
        (LAST_NS + 7_000_000, MODAL, "1 message(s) too many"),
    ]


def test_the_last_state_lost_or_said_twice_is_named_once(golden: Bag) -> None:
    state = golden.records[-1].cdr
    for played, text in ((with_last(golden), "missing"), (with_last(golden, state, state), "too many")):
        (only,) = compared(golden, played).divergences
        assert (only.stamp_ns, only.topic, only.text) == (LAST_NS, MODAL, f"1 message(s) {text}")
    assert compared(golden, golden).is_equal


def test_an_update_tells_every_topic_that_lost_or_won_messages(golden: Bag) -> None:
    late = with_last(golden, *(modal_state(LAST_NS + k) for k in (1, 2)))
    found = compared(golden, late).divergences
    (table,) = renewal_tables("arm", Renewal((), found, golden.counts, late.counts, is_as_before=False))
    assert [list(row) for row in table.rows] == [
        [MODAL, "1 message(s) missing", "0.095000000", 1, TICKS, TICKS + 1],
        [MODAL, "1 message(s) too many", "0.095000001", 2, TICKS, TICKS + 1],
    ]
    assert renewal_tables("arm", Renewal((), (), golden.counts, golden.counts, is_as_before=True)) == []


def test_an_update_tells_every_field_that_moved(golden: Bag) -> None:
    moved = tuple(Moved(MODAL, f"field_{k}", 1.0, 1.0, 2.0, LAST_NS, 1) for k in range(38))
    (table,) = renewal_tables("arm", Renewal(moved, (), golden.counts, golden.counts, is_as_before=False))
    assert [row[1] for row in table.rows] == [item.field for item in moved]
    assert table.notes == []
    judged = moved_table("arm", moved, 8)
    assert (len(judged.rows), judged.notes) == (8, ["30 more fields moved"])


def test_one_sensor_less_in_a_message_has_moved(golden: Bag) -> None:
    state = decode(golden.records[-1])
    state.sensors.clear()
    fewer = with_last(golden, bytes(bag_types().serialize_cdr(state, golden.records[-1].type)))
    (moved,) = find_moved(golden, fewer, [MODAL], TOLERANCES)
    assert (moved.field, moved.messages) == ("sensors", 1)
    state.sensors.extend(decode(golden.records[-1]).sensors * 2)
    more = with_last(golden, bytes(bag_types().serialize_cdr(state, golden.records[-1].type)))
    (moved,) = find_moved(golden, more, [MODAL], TOLERANCES)
    assert (moved.field, moved.messages) == ("sensors", 1)
