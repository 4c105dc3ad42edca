"""Models along a trajectory: few, near it, and exact where it rests."""

from typing import Literal

import numpy as np
import pytest
from arms import arm, tree
from numpy.typing import NDArray

from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_schedule import BLOCK, ModelSchedule, ScheduleSettings

Array = NDArray[np.float64]
PERIOD_NS = 5_000_000
SPEED, FAR = 2.0, 1.0  # rad/s, rad


def there() -> Trajectory:
    """Return a ramp of half a second of the base's axis, after 0.2 s of rest."""
    t = np.array([0.0, 0.2, 0.2 + FAR / SPEED, 1.5])
    theta = np.array([[0.0], [0.0], [FAR], [FAR]])
    rate = np.array([[0.0], [0.0], [0.0], [0.0]])
    return Trajectory(t, theta, rate, np.zeros((4, 1)))


def models(**settings: float) -> list[tuple[float, float]]:
    config, planar = arm("single_link"), tree("single_link")
    schedule = ModelSchedule(planar, config, there(), ScheduleSettings(**settings))
    served = schedule.plan(linearize(planar), 1.5, PERIOD_NS)
    return [(stamp * 1e-9, float(model.pose[0])) for stamp, model in served]


def test_by_default_one_model_serves_the_whole_motion() -> None:
    assert models() == []


def test_models_are_as_many_as_the_distance_asks_for() -> None:
    assert FAR / 0.1 - 2 <= len(models(angle=0.1)) <= FAR / 0.1 + 1


def test_the_model_in_use_is_never_further_than_allowed_from_where_the_reference_will_be() -> None:
    served = [(0.0, 0.0), *models(angle=0.1, lead=0.08)]
    for t in np.arange(0.0, 1.5, PERIOD_NS * 1e-9):
        pose = [pose for since, pose in served if since <= t + 1e-9][-1]
        assert abs(there().sample(np.array([t + 0.08]))[0][0, 0] - pose) <= 0.1 + 1e-9


def test_where_the_reference_rests_the_model_is_of_that_pose() -> None:
    assert abs(models(angle=0.17)[-1][1] - FAR) <= 0.05 * 0.17


def test_a_motion_planned_ahead_has_the_models_that_come_up_tick_by_tick() -> None:
    planar = tree("single_link")
    schedule = ModelSchedule(planar, arm("single_link"), there(), ScheduleSettings(angle=0.07))
    model, served = linearize(planar), []
    ahead = list(schedule.plan(model, 1.5, PERIOD_NS))
    for k in range(320):
        following = schedule.next(model, k * PERIOD_NS * 1e-9)
        if following is not None:
            model = following
            served.append((k * PERIOD_NS, model.model_id))
    assert served == [(stamp_ns, model.model_id) for stamp_ns, model in ahead]
    assert len(served) > 10


def note_looks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the list that will tell how many instants of a trajectory are asked for, each time."""
    sizes: list[int] = []
    stacked = Trajectory.stacked

    def noted(self: Trajectory, times: Array, *side: Literal["left", "right"]) -> Array:
        sizes.append(len(times))
        return stacked(self, times, *side)

    monkeypatch.setattr(Trajectory, "stacked", noted)
    return sizes


def test_an_arm_that_one_model_serves_for_ever_is_looked_at_no_more_in_a_longer_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A goal of 3000 s was given up under load: the model node looked too long before it said a word."""
    sizes = note_looks(monkeypatch)
    schedule = ModelSchedule(tree("single_link"), arm("single_link"), there(), ScheduleSettings())
    looks = []
    for end in (1.5, 3000.0):
        assert not list(schedule.poses(np.zeros(1), end, PERIOD_NS))
        looks.append(sum(sizes))
        sizes.clear()
    assert looks[1] <= looks[0]


def test_a_long_motion_is_looked_at_piece_by_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = note_looks(monkeypatch)
    schedule = ModelSchedule(tree("single_link"), arm("single_link"), there(), ScheduleSettings(angle=0.17))
    poses = list(schedule.poses(np.zeros(1), 600.0, PERIOD_NS))
    assert [pose for _, pose in poses] == [pose for _, pose in schedule.poses(np.zeros(1), 1.5, PERIOD_NS)]
    assert len(poses) > 4 and max(sizes) <= BLOCK
