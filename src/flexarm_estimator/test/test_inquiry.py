"""An inquiry looks for more and doubts what it has told, in turn; unless urgent it waits for late frames."""

from collections import deque
from typing import Any

import numpy as np
import pytest

from flexarm_estimator.isolation import inquiry
from flexarm_estimator.isolation.case import Case
from flexarm_estimator.isolation.inquiry import Conclusion, Inquiry
from flexarm_estimator.isolation.isolation import Explanation
from flexarm_estimator.isolation.second_opinion import SecondOpinion

PIECES = 4
DETACHED = Explanation((1,), "is detached", np.array([150.0, 150.0]), 1.0)
OTHER = Explanation((2,), "is detached", np.array([150.0, 150.0]), 1.0)
FLIPPED = Explanation((1,), "sign is flipped", np.array([90.0, 90.0]), 1.0)


class Desk:
    """An inquiry whose investigations end as told, after so many pieces."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, pieces: int = 1) -> None:
        self.end: Explanation | None = None
        self.begun: list[str] = []
        self.inquiry, self.t = Inquiry(0.0, SecondOpinion(), pieces), 0.0
        monkeypatch.setattr(inquiry, "investigate", lambda *rest: self._work("new"))
        monkeypatch.setattr(
            inquiry, "reconsider", lambda case, entries, told: self._work(str(told.channels[0]))
        )

    def _work(self, what: str) -> Any:
        self.begun.append(what)
        for _ in range(PIECES):
            yield
        return self.end

    def begin(self, is_urgent: bool = False) -> None:
        entry: Any = type("Entry", (), {"t": self.t})
        case = Case(None, frozenset(), None, is_urgent)  # type: ignore[arg-type]
        self.inquiry.begin(case, deque([entry]), last_tick=60)

    def finish(self, end: Explanation | None, is_urgent: bool = False) -> Conclusion | None:
        """Go through an investigation that ends so."""
        self.begin(is_urgent)
        self.end, found = end, None
        while self.inquiry.is_busy:
            self.t += 0.005
            found = self.inquiry.go_on(self.t, is_suspected=False, has_frame=False)
        return found


@pytest.fixture
def desk(monkeypatch: pytest.MonkeyPatch) -> Desk:
    return Desk(monkeypatch)


def test_what_was_told_is_doubted_in_turn_with_the_search_for_more(desk: Desk) -> None:
    assert desk.finish(DETACHED) == Conclusion(DETACHED, is_told=True)
    assert desk.finish(None) is None
    assert desk.finish(OTHER) == Conclusion(OTHER, is_told=True)
    assert desk.inquiry.told == [DETACHED, OTHER]
    for _ in range(4):
        assert desk.finish(None) is None
    assert desk.begun == ["new", "1", "new", "1", "new", "2", "new"]


def test_what_turns_out_to_be_well_is_taken_back(desk: Desk) -> None:
    desk.finish(DETACHED)
    assert desk.finish(DETACHED) == Conclusion(DETACHED, is_told=False)
    assert desk.inquiry.told == []
    desk.finish(None)
    desk.finish(None)
    assert desk.begun == ["new", "1", "new", "new"]


def test_what_a_second_window_has_to_say_is_not_told_before(desk: Desk) -> None:
    assert desk.finish(FLIPPED) is None
    assert desk.inquiry.told == []
    assert desk.inquiry.awaits(desk.t) == 61
    assert desk.finish(FLIPPED) == Conclusion(FLIPPED, is_told=True)


@pytest.mark.parametrize(("is_urgent", "ticks"), [(False, PIECES + 1), (True, 1)])
def test_what_is_urgent_is_done_several_pieces_at_a_time(desk: Desk, is_urgent: bool, ticks: int) -> None:
    desk.finish(None, is_urgent)
    assert round(desk.t / 0.005) == ticks


def test_a_close_inquiry_does_as_many_pieces_at_a_time_as_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, pieces=2)
    desk.finish(None)
    assert round(desk.t / 0.005) == PIECES // 2 + 1


def test_a_piece_waits_for_late_frames_but_not_for_ever_nor_where_somebody_is_suspected(desk: Desk) -> None:
    def ticks(is_suspected: bool) -> int:
        desk.begin()
        count = 0
        while desk.inquiry.is_busy:
            desk.inquiry.go_on(0.0, is_suspected, has_frame=True)
            count += 1
        return count

    assert ticks(is_suspected=False) == 4 * (PIECES + 1)
    assert ticks(is_suspected=True) == 1


def test_an_investigation_that_is_left_tells_nothing(desk: Desk) -> None:
    desk.begin()
    assert desk.inquiry.go_on(0.0, is_suspected=False, has_frame=False) is None
    desk.inquiry.drop()
    assert not desk.inquiry.is_busy
    desk.finish(None)
    assert desk.begun == ["new", "new"]
