"""Steps in turn, with patience."""

from __future__ import annotations

from flexarm_bringup.series import Series, SeriesError


class Door:
    """Steps of somebody who walks through a door."""

    def __init__(self) -> None:
        self.is_open, self.is_locked, self.took = False, False, list[str]()

    def _walk(self) -> bool:
        self.took.append("walk")
        return True

    def _wait_for_door(self) -> bool:
        self.took.append("door")
        if self.is_locked:
            raise SeriesError("locked")
        return self.is_open

    def series(self, patience: float = 10.0) -> Series:
        return Series([self._walk, self._wait_for_door, self._walk], patience, 0.0)


def test_a_look_takes_one_step_and_repeats_one_that_cannot_be_taken_yet() -> None:
    door = Door()
    series = door.series()
    assert [series.look(now) for now in (1.0, 2.0, 3.0)] == [None] * 3
    door.is_open = True
    assert series.look(4.0) is None and series.is_last and not series.is_over
    assert series.look(5.0) == "" and series.is_over
    assert door.took == ["walk", "door", "door", "door", "walk"]


def test_patience_counts_from_the_last_progress_and_names_the_step() -> None:
    series = Door().series(10.0)
    assert series.look(9.0) is None  # a step
    assert series.look(19.0) is None and series.waited(19.0) == 10.0
    series.note(15.0)  # something else
    assert series.look(25.0) is None
    assert series.look(25.1) == "no progress for 10 s: wait for door"


def test_a_step_that_is_slow_but_taken_is_no_failure() -> None:
    door = Door()
    series = door.series(1.0)
    series.look(0.0)
    door.is_open = True
    assert series.look(60.0) is None and series.is_last


def test_what_refuses_ends_the_series_for_good() -> None:
    door = Door()
    series = door.series()
    series.look(0.0)
    door.is_locked = True
    assert series.look(1.0) == "locked"
    door.is_locked, door.is_open = False, True
    assert series.look(2.0) == "locked" and door.took == ["walk", "door"]


def test_the_first_reason_stays() -> None:
    series = Door().series()
    series.end("enough")
    series.end("late")
    assert series.look(1.0) == "enough"
    assert Series([], 1.0, 0.0).look(0.0) == ""
