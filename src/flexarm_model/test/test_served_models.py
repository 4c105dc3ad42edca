"""Models of a reference that is refused after they are out: what was used before is used again."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from flexarm_model.served.pending_models import PendingModels
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.served_models import ServedModels


def model(name: str) -> ReducedModel:
    return cast(ReducedModel, SimpleNamespace(model_id=name))


class Heard:
    """Who hears the models and uses each from its stamp on."""

    def __init__(self) -> None:
        self._pending: PendingModels[Any] = PendingModels()
        self.in_use, self.sent = "", 0

    def take(self, sent: ReducedModel, stamp_ns: int) -> None:
        self._pending.add(stamp_ns, sent.model_id)
        self.sent += 1

    def at(self, stamp_ns: int) -> str:
        self.in_use = self._pending.due(stamp_ns) or self.in_use
        return self.in_use


@pytest.fixture
def heard() -> Heard:
    return Heard()


@pytest.fixture
def served(heard: Heard) -> ServedModels:
    return ServedModels(model("home"), heard.take)


def follow(served: ServedModels, start_ns: int, *models: tuple[int, str]) -> None:
    served.serve_motion([(after_ns, model(name)) for after_ns, name in models], start_ns)


def test_a_motion_s_models_are_used_from_their_times_on(served: ServedModels, heard: Heard) -> None:
    follow(served, 100, (10, "a"), (20, "b"))
    assert [heard.at(t) for t in (50, 109, 110, 120)] == ["home", "home", "a", "b"]
    assert served.count == heard.sent == 3 and served.newest.model_id == "b"


def test_models_of_a_refused_motion_are_never_used(served: ServedModels, heard: Heard) -> None:
    follow(served, 100, (10, "a"))
    assert served.take_back(100)
    assert heard.at(200) == "home" and served.at(200).model_id == "home"


def test_a_motion_that_a_refused_one_replaced_goes_on(served: ServedModels, heard: Heard) -> None:
    follow(served, 100, (10, "a"), (30, "b"), (50, "c"))
    follow(served, 120, (0, "x"), (15, "y"))
    assert served.take_back(120)
    assert [heard.at(t) for t in (112, 125, 135, 150)] == ["a", "a", "b", "c"]


def test_a_refused_motion_that_had_begun_is_left_at_once(served: ServedModels, heard: Heard) -> None:
    follow(served, 100, (0, "x"), (50, "y"))
    assert heard.at(105) == "x"
    served.take_back(100)
    assert heard.at(110) == "home" and heard.at(200) == "home"


def test_only_the_last_motion_is_taken_back_and_only_once(served: ServedModels, heard: Heard) -> None:
    follow(served, 100, (10, "a"))
    follow(served, 200, (10, "b"))
    assert not served.take_back(100)
    assert served.take_back(200) and not served.take_back(200)
    assert heard.at(300) == "a"


def test_asking_for_a_later_time_changes_nothing(served: ServedModels, heard: Heard) -> None:
    """A reference that begins later was planned with the model of its begin, and refused: so were both."""
    follow(served, 100, (10, "a"))
    assert served.at(110).model_id == "a" and served.at(105).model_id == "home"
    assert served.take_back(100)
    assert heard.at(200) == "home" and served.at(200).model_id == "home"


def test_what_was_used_before_is_forgotten(served: ServedModels) -> None:
    """An arm that is moved by hand gets model after model, and no reference."""
    for t in range(100):
        served.pass_by(t)
        served.serve(model(f"{t}"), t + 2)
        assert served.at(t).model_id == ("home" if t < 2 else f"{t - 2}")
        assert len(served._pending.waiting) <= 3


def test_a_motion_ahead_does_not_make_those_before_it_forgotten(served: ServedModels, heard: Heard) -> None:
    """What waited for a time before its begin was lost: nobody voided it when an earlier motion came."""
    follow(served, 100, (10, "a"), (30, "b"))
    follow(served, 200, (10, "c"))
    assert [served.at(t).model_id for t in (100, 110, 199)] == ["home", "a", "b"]
    follow(served, 100)
    assert [heard.at(t) for t in (110, 130, 220)] == ["home"] * 3


def test_what_is_over_is_not_kept(served: ServedModels) -> None:
    for motion in range(20):
        follow(served, 100 * motion, (10, "a"), (20, "b"))
        served.pass_by(100 * motion + 50)
    assert not served.has_after(0) and served.at(5000).model_id == "b"


class Posed(SimpleNamespace):
    """A model whose name is its pose."""

    @property
    def pose(self) -> str:
        return str(self.model_id)[0]


def posed(name: str) -> ReducedModel:
    return cast(ReducedModel, Posed(model_id=name))


def softer(pose: Any) -> ReducedModel:
    return posed(f"{pose} soft")


MS = 1_000_000  # ns


def motion(served: ServedModels, *models: tuple[int, str]) -> None:
    served.serve_motion([(after * MS, posed(name)) for after, name in models], 100 * MS)


def in_turn(served: ServedModels, heard: Heard, since: int, until: int) -> dict[int, str]:
    """Let time go on; returns when each model was sent [ms], and which."""
    sent = {}
    for now in range(since, until, 5):
        if served.go_on(now * MS):
            sent[now] = served.newest.model_id
    return sent


def test_renewed_models_are_those_of_the_same_poses_from_then_on_and_come_in_turn(heard: Heard) -> None:
    """Ten at once took a law most of ten periods, in which the guard waited for commands."""
    served = ServedModels(posed("h"), heard.take)
    motion(served, (10, "a"), (300, "b"), (420, "c"), (900, "d"))
    before = served.count
    served.renew(softer, 115 * MS)
    assert served.count == before + 1 and served.newest.model_id == "a soft"
    assert served.has_after(10**15)
    sent = in_turn(served, heard, 15, 1100)
    assert list(sent.values()) == ["b soft", "c soft", "d soft"]
    assert list(sent) == [15, 65, 500]  # spread, and at most half a second ahead of 400, 520 and 1000
    at = [heard.at(t * MS) for t in (50, 112, 115, 399, 400, 520, 1000)]
    assert at == ["h", "a", "a soft", "a soft", "b soft", "c soft", "d soft"]
    assert not served.has_after(10**15)


def test_models_that_are_needed_soon_are_not_spread(heard: Heard) -> None:
    served = ServedModels(posed("h"), heard.take)
    motion(served, (30, "a"), (40, "b"), (50, "c"))
    served.renew(softer, 100 * MS)
    assert list(in_turn(served, heard, 0, 100)) == [0, 5, 10]


def test_a_renewal_on_the_way_renews_what_waits_too(heard: Heard) -> None:
    served = ServedModels(posed("h"), heard.take)
    motion(served, (30, "a"), (900, "b"))
    served.renew(softer, 100 * MS)
    served.renew(lambda pose: posed(f"{pose} hard"), 110 * MS)
    assert list(in_turn(served, heard, 10, 1000).values()) == ["a hard", "b hard"]


def test_a_new_motion_begins_where_the_renewed_one_would_be(heard: Heard) -> None:
    served = ServedModels(posed("h"), heard.take)
    motion(served, (30, "a"), (300, "b"))
    served.renew(softer, 100 * MS)
    served.serve_motion([(10 * MS, posed("c"))], 500 * MS)
    assert [heard.at(t * MS) for t in (130, 400, 510)] == ["a soft", "b soft", "c"]
    assert not served.go_on(10**15)


def test_models_that_are_taken_back_after_a_renewal_are_renewed_too(heard: Heard) -> None:
    served = ServedModels(posed("h"), heard.take)
    served.serve(posed("c"), 140 * MS)
    motion(served, (10, "a"), (20, "b"))
    served.renew(softer, 105 * MS)
    assert served.take_back(100 * MS)
    assert not served.go_on(10**15)
    at = [heard.at(t * MS) for t in (99, 100, 139, 140)]
    assert at == ["h", "h soft", "h soft", "c soft"]


def test_a_model_of_the_measured_pose_ends_what_was_still_to_be_made_anew(heard: Heard) -> None:
    """After a stop nobody follows the motion whose models were being sent."""
    served = ServedModels(posed("h"), heard.take)
    motion(served, (30, "a"), (900, "b"))
    served.renew(softer, 100 * MS)
    served.serve(posed("m"), 120 * MS)
    assert not served.go_on(10**15) and not served.has_after(120 * MS)
    assert [heard.at(t * MS) for t in (110, 130, 2000)] == ["h soft", "m", "m"]
