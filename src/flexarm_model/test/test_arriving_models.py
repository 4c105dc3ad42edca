"""Models of a motion come in one go; a node goes on with its periods meanwhile."""

from types import SimpleNamespace

import pytest

from flexarm_model.ros.arriving_models import QUIET, ArrivingModels


class Node:
    """Counts what it has taken, by its own clock."""

    def __init__(self, is_paced=True):
        self.t, self.taken = 0.0, []
        self.models = ArrivingModels(lambda msg: self.taken.append(stamp(msg)), is_paced, lambda: self.t)

    def receive(self, *seconds):
        for s in seconds:
            whole, rest = divmod(round(10 * s), 10)
            at = SimpleNamespace(sec=whole, nanosec=rest * 10**8)
            self.models.add(SimpleNamespace(header=SimpleNamespace(stamp=at)))

    def step(self, s):
        """Do a period whose state has the stamp ``s`` [s]."""
        self.models.take_due(round(s * 1e9))
        before = len(self.taken)
        self.models.work_ahead()
        return len(self.taken) - before


def stamp(msg):
    return msg.header.stamp.sec + msg.header.stamp.nanosec * 1e-9


def test_in_a_running_loop_one_model_is_taken_in_a_period():
    node = Node()
    assert node.step(0.0) == 0
    node.receive(1.0, 1.1, 1.2)
    assert node.taken == []
    assert [node.step(0.005 * k) for k in range(4)] == [1, 1, 1, 0]
    assert node.taken == pytest.approx([1.0, 1.1, 1.2])


def test_what_is_due_is_taken_before_its_state():
    node = Node()
    node.step(0.0)
    node.receive(1.0, 1.1, 1.2)
    node.models.take_due(1_100_000_000)
    assert node.taken == pytest.approx([1.0, 1.1])


def test_models_of_a_newer_motion_are_taken_after_those_that_they_replace():
    node = Node()
    node.step(0.0)
    node.receive(2.0, 2.1, 1.0)
    node.models.take_due(1_000_000_000)
    assert node.taken == pytest.approx([2.0, 2.1, 1.0])


@pytest.mark.parametrize("is_paced", [True, False])
def test_where_nobody_steps_or_in_lockstep_all_are_taken_at_once(is_paced):
    node = Node(is_paced)
    node.receive(1.0, 1.1)
    assert len(node.taken) == 2
    if not is_paced:
        node.step(0.0)
        node.receive(1.2)
        assert len(node.taken) == 3


def test_what_still_waits_when_the_loop_ends_is_taken_then():
    node = Node()
    node.step(0.0)
    node.receive(1.0, 1.1)
    node.t = 0.9 * QUIET
    node.models.look()
    assert node.taken == []
    node.t = QUIET
    node.models.look()
    assert len(node.taken) == 2


def test_after_a_model_there_is_a_pause_as_long_as_it_took():
    """Ten in ten periods, each for most of one: the guard heard no command for 50 ms, and stopped the arm."""
    node, period = Node(), 0.005
    node.models._take = lambda msg: (node.taken.append(stamp(msg)), setattr(node, "t", node.t + 0.0044))
    node.step(0.0)
    node.receive(*range(1, 5))
    took = []
    for k in range(8):
        node.t = max(node.t, k * period) + 0.0005
        took.append(node.step(node.t))
    assert took == [1, 0, 1, 0, 1, 0, 1, 0]
