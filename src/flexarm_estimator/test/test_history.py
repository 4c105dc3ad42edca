import numpy as np
import pytest

from flexarm_estimator.filter import Belief
from flexarm_estimator.history import History, Instant
from flexarm_estimator.measurement import Measurement

BELIEF = Belief(np.zeros(2), np.eye(2))


def sample(t, sensor="a"):
    return Measurement(sensor, t, np.zeros(1))


def filled(times, length=0.3):
    history = History(Instant(0.0, np.array([0.0, 1.0]), BELIEF), length)
    for i, t in enumerate(times):
        history.advance(t, np.array([float(i + 1), 1.0]))
    return history


def test_a_sample_joins_the_instant_of_its_stamp():
    history = filled([0.1, 0.2, 0.3])
    assert history.insert(sample(0.2)) == 2
    assert history.insert(sample(0.2 + 5e-7, "b")) == 2
    assert set(history.instants[2].pending) == {"a", "b"}
    assert len(history.instants) == 4


def test_a_sample_between_two_instants_splits_the_interval_and_keeps_its_torque():
    history = filled([0.1, 0.2, 0.3])
    assert history.insert(sample(0.14)) == 2
    assert [instant.t for instant in history.instants] == [0.0, 0.1, 0.14, 0.2, 0.3]
    assert history.instants[2].u[0] == history.instants[3].u[0] == 2.0


def test_time_that_stands_still_adds_no_instant():
    history = filled([0.1])
    assert history.advance(0.1, np.zeros(2)) == 2
    assert len(history.instants) == 2


def test_what_is_older_than_the_history_is_forgotten_but_its_last_instant():
    history = filled(np.arange(1, 101) * 0.01)
    history.forget()
    assert history.oldest == pytest.approx(0.7, abs=0.0101)
    assert history.instants[1].t > 0.7 - 1e-9
    assert history.now.t == pytest.approx(1.0)


def test_a_belief_goes_through_all_models_since_when_somebody_looks_and_not_before():
    history, asked = filled([0.1, 0.2]), []

    def doubled(belief):
        asked.append("doubled")
        return Belief(2.0 * belief.x, 4.0 * belief.P)

    def moved(belief):
        asked.append("moved")
        return Belief(belief.x + 1.0, belief.P)

    for apply in (doubled, moved):
        for instant in history.instants:
            instant.carry_over(apply)
    assert not asked
    for _ in range(2):  # once is enough
        assert np.array_equal(history.now.belief.x, [1.0, 1.0])
        assert np.array_equal(history.now.belief.P, 4.0 * np.eye(2))
    assert asked == ["doubled", "moved"]
    history.instants[0].belief = BELIEF  # computed again with the new model
    assert np.array_equal(history.instants[0].belief.x, [0.0, 0.0])
