"""A soak on its way: what it calls moving, where its next move begins, and how it is interrupted."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.soak.script import move
from flexarm_bringup.soak.sent_move import REST, SentMove
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

SINGLE = load_config(find_manipulator("single_link"))
S = 1_000_000_000  # ns


class Arm:
    """Stands in for the node of a soak: a usable pose, a clock, and what was sent."""

    is_armed, answer, now_ns = True, "", 10 * S

    def __init__(self) -> None:
        self.ready = {"guard": True}
        self.late, self.stops, self.errors = LateCycles(), Counter[str](), Counter[str]()
        self.sent: list[Any] = []

    def spin(self, seconds: float) -> None:
        """Hear nothing."""

    def pose(self) -> np.ndarray:
        return np.array([0.125])

    def send(self, reference: Any, names: Any, zero_ns: int) -> None:
        self.answer = ""
        self.sent.append(reference)


def soak_of(arm: Arm) -> Any:
    """Return a soak on its way that breaks nothing."""
    run_node = pytest.importorskip("flexarm_bringup.soak.run_node", reason="imports nodes")
    job = run_node.SoakJob((), SINGLE, 60.0, 1.0, 1, 0.0, 0.0)
    return run_node._Run(job, arm, SimpleNamespace(pids={}), print)


def test_an_arm_moves_from_the_begin_of_its_move_to_its_end_and_neither_before_nor_while_it_rests() -> None:
    reference = move(np.random.default_rng(1), np.zeros(1), np.array([0.3]), SINGLE)
    sent = SentMove.of(reference, 2 * S)
    end = 2 * S + round(S * float(reference.t[-1]))
    for stamp, moves in ((0, False), (2 * S - 1, False), (2 * S, True), (end - 1, True), (end, False)):
        assert sent.moves(stamp, "reference accepted: 150 points") is moves
    assert not sent.moves(2 * S + 1, "reference refused: too fast")
    assert not sent.is_over(end) and sent.is_over(end + round(S * REST))


@pytest.mark.parametrize("answer", ["reference accepted: 150 points", "reference refused: too fast"])
def test_the_move_after_a_refused_one_begins_where_the_arm_is(answer: str) -> None:
    arm = Arm()
    run = soak_of(arm)
    run._act()
    (first,) = arm.sent
    assert first.theta[0] == pytest.approx(arm.pose())
    arm.answer, is_refused = answer, "refused" in answer
    arm.now_ns += 3 * S
    assert run._doing(arm.now_ns) == ("standing" if is_refused else "moving")
    arm.now_ns += 7 * S
    run._act()
    assert arm.sent[1].theta[0] == pytest.approx(arm.pose() if is_refused else first.theta[-1])
    assert run._counts == {"moves refused" if is_refused else "moves done": 1}


def test_a_move_is_counted_once_also_while_no_pose_is_known_for_the_next() -> None:
    arm = Arm()
    run = soak_of(arm)
    run._act()
    arm.answer, arm.now_ns = "reference refused: too fast", 20 * S
    arm.pose = lambda: None  # type: ignore[assignment,method-assign,return-value]
    for _ in range(3):
        run._act()
    assert run._counts == {"moves refused": 1} and len(arm.sent) == 1


def test_a_soak_that_is_interrupted_tells_what_it_has_measured_and_that_it_did_not_come_to_its_end() -> None:
    arm, looks = Arm(), []
    run = soak_of(arm)
    run._look = lambda: looks.append(run._counts.update({"moves done": 1}))
    found = run.outcome(lambda: len(looks) == 3)
    assert found.counts["moves done"] == 3 and found.failure == "interrupted after 0 s"
    arm.ready = {"guard": False}
    run = soak_of(arm)
    run._tend = lambda: None
    assert run.outcome(lambda: True).failure == "interrupted while it waited for guard"
