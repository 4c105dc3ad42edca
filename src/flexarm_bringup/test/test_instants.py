"""A bag in which a stamp is that of two instants is refused by whatever finds things by their stamps."""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.consistency.instants import STATES, check_instants

GOLDEN = Path(__file__).parents[3] / "tests" / "golden" / "single_link" / "bag"
HISTORY = 0.5


@pytest.fixture(scope="module")
def golden() -> Bag:
    return check_bag(GOLDEN)


def states(bag: Bag, instants: Iterable[float]) -> Bag:
    """Return a bag with a state at every instant [s], read by time."""
    like = next(record for record in bag.records if record.name == STATES)
    return replace(bag, records=tuple(at(like, t, k) for k, t in enumerate(instants)))


def at(record: Record, t: float, said: float) -> Record:
    sec, nanosec = divmod(round(1e9 * t), 10**9)
    cdr = record.cdr[:4] + struct.pack("<iI", sec, nanosec) + record.cdr[12:-8] + struct.pack("<d", said)
    return replace(record, cdr=cdr)


def ticks(start: float, end: float) -> list[float]:
    return [start + 0.005 * k for k in range(round((end - start) / 0.005))]


@pytest.mark.parametrize(
    "instants",
    [
        ticks(0.0, 1.2),  # a part of a second is no fewer
        ticks(0.0, 6.3),
        [*ticks(0.0, 4.0), *ticks(4.4, 9.0)],  # a gap
        [*ticks(0.0, 4.0), *ticks(1.7e9, 1.7e9 + 5.0)],  # a clock that was set at last
        [t for k in range(0, 800, 4) for t in ticks(0.0, 4.0)[k : k + 4][::-1]],  # out of order
        [t for k in range(0, 800, 5) for t in [0.005 * k + 0.0001 * i for i in range(5)]],  # in bursts
        [0.0],
        [],
    ],
)
def test_a_run_in_which_time_goes_on_is_taken(golden: Bag, instants: list[float]) -> None:
    check_instants(states(golden, instants), HISTORY)


def test_a_message_that_is_recorded_twice_is_that_of_one_instant(golden: Bag) -> None:
    once = states(golden, ticks(0.0, 3.0))
    twice = replace(once, records=tuple(record for record in once.records for _ in range(2)))
    check_instants(twice, HISTORY)


@pytest.mark.parametrize("back", [0.1, 0.2, 0.2013])
@pytest.mark.parametrize("by_time", [False, True])
def test_a_stretch_of_time_that_is_told_twice_is_refused(golden: Bag, back: float, by_time: bool) -> None:
    """A clock set back by 0.2 s: tip errors of 1624 um were tabled, 98 um were true; stamps or all of it."""
    instants = [*ticks(0.0, 0.5), *(t - back for t in ticks(0.5, 1.0))]
    with pytest.raises(
        BagError, match=r"4\d joint_states from 0\.\d+ s to 0\.\d+ s later, usual are 20: two"
    ):
        check_instants(states(golden, sorted(instants) if by_time else instants), HISTORY)


def test_two_recordings_one_after_the_other_are_refused(golden: Bag) -> None:
    twice = states(golden, [*ticks(0.0, 9.0), *ticks(4.0, 9.0)])
    with pytest.raises(BagError, match=r"run back by 5 s at 8.995 s: two recordings, or a clock"):
        check_instants(twice, HISTORY)


def test_two_instants_written_at_one_time_are_refused(golden: Bag) -> None:
    """A clock that was set back by 5 s: tip errors of 133 mm were tabled, 15 um were true."""
    both = states(
        golden, sorted([*ticks(0.0, 9.0), *(t + 0.0013 for t in ticks(6.0, 8.0)), *ticks(9.0, 20.0)])
    )
    with pytest.raises(BagError, match=r"4\d joint_states from .* usual are 20: two recordings, or a clock"):
        check_instants(both, HISTORY)
