import numpy as np
import pytest

from flexarm_estimator.filter import Belief
from flexarm_estimator.history import History, Instant
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.state.state_map import StateMap

BELIEF = Belief(np.zeros(2), np.eye(2))


def sample(t, sensor="a"):
    return Measurement(sensor, t, np.zeros(1))


def filled(times, length=0.3):
    history = History(Instant(0.0, np.array([0.0, 1.0]), "parts", BELIEF), length)
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


def doubled(history):
    history.enter("new parts", StateMap(2.0 * np.eye(2), np.zeros((2, 2))))


def test_where_a_model_is_adopted_the_state_is_in_its_coordinates_and_the_past_is_not():
    history = filled([0.1, 0.2])
    history.now.belief = Belief(np.ones(2), np.eye(2))
    doubled(history)
    history.advance(0.3, np.zeros(2))
    assert [instant.parts for instant in history.instants] == ["parts"] * 3 + ["new parts"] * 2
    assert np.array_equal(history.instants[2].belief.x, [1.0, 1.0])
    for instant in history.instants[3:]:
        assert np.array_equal(instant.belief.x, [2.0, 2.0])
        assert np.array_equal(instant.belief.P, 4.0 * np.eye(2))
    assert history.insert(sample(0.25)) == 4
    assert history.instants[4].parts == "new parts"


@pytest.mark.parametrize("off", [0.0, 5e-7, -5e-7])
def test_a_sample_of_the_time_of_an_adoption_is_of_the_model_before(off):
    history = filled([0.1, 0.2])
    doubled(history)
    doubled(history)
    assert history.insert(sample(0.2 + off)) == 2


def test_nothing_is_sampled_where_only_a_model_was_adopted():
    """The start and two models at the same time: what is sampled within a microsecond comes after them."""
    history = filled([])
    doubled(history)
    doubled(history)
    assert history.insert(sample(5e-7)) == 3
    assert history.instants[3].entry is None and history.instants[3].parts == "new parts"


def test_the_last_instant_before_the_horizon_is_the_fixed_start():
    """A sample may be as old as the history, so the state before it must be known."""
    history = filled([0.2, 0.5, 0.6])
    history.forget()
    assert [instant.t for instant in history.instants] == [0.2, 0.5, 0.6]  # 0.6 - 0.3 lies between two


def test_a_sensor_that_is_withdrawn_leaves_neither_fused_nor_refused_samples_since():
    """What was refused is judged again when the past is: of a sensor out of use it must not be."""
    history = filled([0.1, 0.2, 0.3])
    for instant in history.instants[1:]:
        instant.fused, instant.refused = {"b": sample(instant.t, "b")}, {"a": sample(instant.t)}
    assert history.withdraw("a", 0.2) == 4  # nothing fused has changed
    assert [set(instant.refused) for instant in history.instants[1:]] == [{"a"}, set(), set()]
    assert history.withdraw("b", 0.2) == 2
    assert [set(instant.fused) for instant in history.instants[1:]] == [{"b"}, set(), set()]
