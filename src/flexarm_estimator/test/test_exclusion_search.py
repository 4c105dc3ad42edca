"""The search for who is to blame goes on in pieces, whatever happens to the past meanwhile."""

from collections import Counter

import numpy as np
import pytest
from planar_strip import DT, SENSORS, StripKinematics, arriving, strip_model
from test_exclusion import FRAMES, RECORD, START, creeping, feed, status_of

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.exclusion import search
from flexarm_estimator.exclusion.replay import Replay
from flexarm_estimator.filter import Belief
from flexarm_estimator.settings import EstimatorConfig


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> Counter[int]:
    """How many calls of replays to compute instants there were, by the number of the tick."""
    counts: Counter[int] = Counter()
    compute, advance = Replay._compute, search.Search.advance

    def count(self: Replay, *pair: object) -> int:
        counts[max(counts)] += 1
        return compute(self, *pair)

    def begin(self: search.Search, *parts: object) -> None:
        counts[len(counts)] = 0
        advance(self, *parts)

    monkeypatch.setattr(Replay, "_compute", count)
    monkeypatch.setattr(search.Search, "advance", begin)
    return counts


def test_no_tick_plays_more_than_a_piece_of_the_past(
    computed: Counter[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "WORK", 1e5)
    _, estimates, _ = feed(creeping)
    assert sum(computed.values()) > 80  # a hypothesis has 60 instants and more
    assert max(computed.values()) <= 15
    said = [status_of(estimate, "encoder") for estimate in estimates]
    assert (said.index("faulty", START) - START) * DT <= 0.42


def test_a_replay_in_pieces_is_that_of_the_past_as_it_is_by_now() -> None:
    """Frames that come late change what has been played already; the oldest instants are forgotten."""
    estimator, _, _ = feed(creeping, until=START + 40)
    _, instants = estimator.past
    replay = Replay(estimator._gate.bound, instants, instants[0].belief, "encoder")
    for k in range(START + 40, START + 64):
        replay.advance(6)
        estimator.step(creeping(k, arriving(RECORD, k, FRAMES)), RECORD.tau[k], float(RECORD.t[k]))
        assert replay.follow(estimator.past[1])
    _, instants = estimator.past
    again = Replay(estimator._gate.bound, instants, replay.instants[0].belief, "encoder")
    for each in (replay, again):
        while not each.is_done:
            each.advance(6)
    assert [instant.t for instant in replay.instants] == [instant.t for instant in instants]
    for mine, fresh in zip(replay.instants[1:], again.instants[1:], strict=True):
        assert mine.fused.keys() == fresh.fused.keys()
        assert np.array_equal(mine.belief.x, fresh.belief.x)
        assert np.array_equal(mine.belief.P, fresh.belief.P)


def test_a_search_goes_on_with_the_model_in_use_and_not_with_a_state_that_was_replaced(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(search, "WORK", 1e5)
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    searches, said = set(), []
    for k in range(START + 150):
        samples = creeping(k, arriving(RECORD, k, FRAMES))
        said.append(status_of(estimator.step(samples, RECORD.tau[k], float(RECORD.t[k])), "encoder"))
        searches.add(estimator._exclusion._search)
        if len(searches) > 1:
            estimator.adopt(estimator.prepare(strip_model()))
    assert "faulty" in said and len(searches) == 2

    estimator, _, _ = feed(creeping, until=START + 66)
    now = estimator.past[1][-1].belief
    under_way = estimator._exclusion._search
    estimator.set_belief(Belief(now.x, now.P))
    estimator.step([], RECORD.tau[START + 66], float(RECORD.t[START + 66]))
    assert under_way is not None and estimator._exclusion._search is not under_way
