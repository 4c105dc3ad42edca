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


def test_renewed_models_are_those_of_the_same_poses_from_then_on(heard: Heard) -> None:
    served = ServedModels(posed("h"), heard.take)
    served.serve_motion([(after_ns, posed(name)) for after_ns, name in ((10, "a"), (20, "b"))], 100)
    served.renew(softer, 115)
    assert [heard.at(t) for t in (50, 112, 115, 119, 120)] == ["h", "a", "a soft", "a soft", "b soft"]
    assert served.newest.model_id == "b soft"


def test_models_that_are_taken_back_after_a_renewal_are_renewed_too(heard: Heard) -> None:
    served = ServedModels(posed("h"), heard.take)
    served.serve(posed("c"), 140)
    served.serve_motion([(10, posed("a"))], 100)
    served.renew(softer, 105)
    assert served.take_back(100)
    assert [heard.at(t) for t in (99, 100, 139, 140)] == ["h", "h soft", "h soft", "c soft"]
