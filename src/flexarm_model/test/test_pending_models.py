"""Models wait for their stamp, the same everywhere."""

from flexarm_model.served.pending_models import PendingModels


def queue(*stamps: int) -> PendingModels[str]:
    made: PendingModels[str] = PendingModels()
    for stamp in stamps:
        made.add(stamp, f"from {stamp}")
        made.note(stamp, f"id {stamp}")
    return made


def test_a_model_is_used_from_the_first_instant_at_or_after_its_stamp() -> None:
    waiting = queue(10, 20)
    assert [waiting.due(now) for now in (9, 10, 11, 19, 23, 24)] == [
        None, "from 10", None, None, "from 20", None,
    ]  # fmt: skip


def test_of_several_that_are_due_the_newest_counts() -> None:
    waiting = queue(10, 20, 30)
    assert waiting.due(25) == "from 20"
    assert waiting.due(30) == "from 30"


def test_a_model_voids_those_that_wait_for_its_time_or_later() -> None:
    waiting = queue(10, 20, 30, 20)
    assert not waiting.has_after(20)
    assert waiting.due(99) == "from 20"
    assert queue(10, 20).has_after(19)


def test_receipts_are_equal_only_after_the_same_models_in_the_same_order() -> None:
    assert queue(10, 20).receipt == queue(10, 20).receipt
    assert len({queue(*stamps).receipt for stamps in ((), (10,), (10, 20), (20, 10), (10, 20, 20))}) == 5


def test_a_receipt_does_not_depend_on_what_has_been_used() -> None:
    used = queue(10, 20)
    used.due(15)
    assert used.receipt == queue(10, 20).receipt
