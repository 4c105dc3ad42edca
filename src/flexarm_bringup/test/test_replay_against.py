"""With what a replay is compared: a recording may end anywhere, a replay of the same run may not."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from bag_fixture import PERIOD_NS, write_bag  # noqa: E402

from flexarm_bringup.bags.bag_reader import Bag, check_bag  # noqa: E402
from flexarm_bringup.replaying.replay import _compared, page  # noqa: E402

MODAL = "/flexarm/modal_state"


@pytest.fixture(scope="module")
def replayed(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    """Return a bag of four instants, as a replay is read back."""
    bag = check_bag(write_bag(tmp_path_factory.mktemp("replay") / "bag", 4))
    return replace(bag, custom={**bag.custom, "replay": "true"})


def first_instant(bag: Bag) -> Bag:
    """Return what is left of a bag that has lost all but its first instant."""
    return replace(bag, records=tuple(r for r in bag.records if r.log_time_ns < PERIOD_NS))


def test_a_replay_that_has_lost_its_end_is_no_replay_of_the_same_bag(replayed: Bag) -> None:
    """One that had kept 5 messages of 801 was equal."""
    found = _compared(first_instant(replayed), replayed, are_runs=False)
    first = found.divergences[0]
    assert (first.stamp_ns, first.topic, first.text) == (PERIOD_NS, MODAL, "1 message(s) too many")
    assert len(found.divergences) == 3
    assert _compared(replayed, replayed, are_runs=False).is_equal


@pytest.mark.parametrize(("custom", "are_runs"), [({}, False), ({"replay": "true"}, True)])
def test_a_recording_and_another_run_may_end_before_the_replay(
    custom: dict[str, str], are_runs: bool, replayed: Bag
) -> None:
    golden = replace(first_instant(replayed), custom=custom)
    assert _compared(golden, replayed, are_runs).is_equal


def test_it_is_told_how_many_messages_were_compared_with_none(replayed: Bag) -> None:
    golden = replace(first_instant(replayed), custom={})
    told = page(replayed, replayed, _compared(golden, replayed, are_runs=False))
    assert "3 replayed messages have none to be compared with." in told.lead
    assert told.data["unpaired_messages"] == 3
    whole = page(replayed, replayed, _compared(replayed, replayed, are_runs=False))
    assert "to be compared with" not in whole.lead and whole.data["unpaired_messages"] == 0
