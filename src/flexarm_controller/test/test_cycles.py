"""Which states are answered, and what is counted as missed."""

from __future__ import annotations

import pytest

from flexarm_controller.cycles import Cycles

DT = 0.005
T = 5_000_000  # ns
START = 1_700_000_000_000_000_000


@pytest.mark.parametrize(
    ("periods", "answered", "missed"),
    [
        ((0, 1, 2), (1, 1, 1), 0),
        ((0, 1, 4), (1, 1, 1), 2),
        ((0, 1.4, 2), (1, 1, 1), 0),  # late, but none was missed
        ((0, 5, 5, 3, 6), (1, 1, 0, 0, 1), 4),  # once more, and one that was overtaken
        ((100, 0, 1), (1, 1, 1), 0),  # the clock was set back by half a second
        ((0, 12_000, 12_001), (1, 1, 1), 11_999),  # a minute without a state
        ((0, 12_001, 12_002), (1, 1, 1), 0),  # the clock was set: by a year it was 6307200000
    ],
)
def test_states_are_told_apart_by_their_stamps(
    periods: tuple[float, ...], answered: tuple[int, ...], missed: int
) -> None:
    cycles = Cycles(DT)
    assert tuple(cycles.note(START + round(k * T)) for k in periods) == answered
    assert cycles.missed == missed


def test_before_the_first_state_there_is_no_newest() -> None:
    cycles = Cycles(DT)
    assert (cycles.last_ns, cycles.missed) == (None, 0)
    cycles.note(START)
    assert (cycles.last_ns, cycles.missed) == (START, 0)
