"""A lockstep recording that lost a message is noticed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bag_fixture import PERIOD_NS, joint_state, stamped_header

from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagError, BagWriter
from flexarm_bringup.tick_check import check_ticks
from flexarm_bringup.topics import STREAMS

TICK = "flexarm_interfaces/msg/Tick"


def lockstep_bag(path: Path, ticks: int = 4) -> Bag:
    types = bag_types()
    with BagWriter(path, STREAMS, {}) as writer:
        for k in range(ticks):
            stamp_ns = k * PERIOD_NS
            header, counts = stamped_header(stamp_ns), np.ones(2, dtype=np.uint32)
            msg = types.types[TICK](header, 10 + k, ["joint_states", "not_in_the_table"], counts)
            writer.write("/flexarm/joint_states", stamp_ns, joint_state(stamp_ns, 0.0))
            writer.write("/flexarm/tick", stamp_ns, bytes(types.serialize_cdr(msg, TICK)))
    return check_bag(path)


def without(bag: Bag, name: str, stamp_ns: int) -> Bag:
    kept = [r for r in bag.records if (r.name, r.log_time_ns) != (name, stamp_ns)]
    return replace(bag, records=tuple(kept))


def test_a_whole_recording_passes(tmp_path: Path) -> None:
    assert check_ticks(lockstep_bag(tmp_path / "bag")) == 4


def test_a_real_time_recording_has_no_ticks(tmp_path: Path) -> None:
    assert check_ticks(replace(lockstep_bag(tmp_path / "bag"), records=())) == 0


def test_a_lost_message_is_named(tmp_path: Path) -> None:
    lossy = without(lockstep_bag(tmp_path / "bag"), "/flexarm/joint_states", PERIOD_NS)
    with pytest.raises(BagError, match="tick 11 announced 1 joint_states, the bag has 0"):
        check_ticks(lossy)


def test_a_lost_tick_is_named(tmp_path: Path) -> None:
    lossy = without(lockstep_bag(tmp_path / "bag"), "/flexarm/tick", 2 * PERIOD_NS)
    with pytest.raises(BagError, match="tick 13 follows tick 11"):
        check_ticks(lossy)


def test_ticks_that_begin_again_are_two_runs(tmp_path: Path) -> None:
    """They were called lost messages."""
    bag = lockstep_bag(tmp_path / "bag")
    with pytest.raises(BagError, match="tick 10 follows tick 13: two runs in one bag"):
        check_ticks(replace(bag, records=bag.records * 2))


def test_a_recording_may_end_before_the_last_tick_was_answered(tmp_path: Path) -> None:
    cut = without(lockstep_bag(tmp_path / "bag"), "/flexarm/joint_states", 3 * PERIOD_NS)
    assert check_ticks(cut) == 4
