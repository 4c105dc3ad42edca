"""Which one hypothesis explains the recent past on which sensors disagree, a piece at every tick.

From the belief before the first doubt, without each sensor in turn, where every sensor that tells where the
axes are had agreed with that belief before: who is wrong now contradicts a past that it shared. But the past
may have followed the other one, astray and slowly: where that explains as much, nobody is named. Then from a
broad start, with all sensors: the state was wrong, and only that; then from a broad start, without each
sensor in turn. A hypothesis that is refuted is played no further. The one that is left follows until now.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.exclusion.replay import Replay, heard_sensors
from flexarm_estimator.filter import Belief
from flexarm_estimator.history import History
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.judging.health import Health

Array = NDArray[np.float64]
WORK = 400e3  # multiplications at one tick, about
_OVERHEAD = 12e3  # of them that could be done while an instant is prepared
_SETUP = 80e3  # while a replay is set up, or follows
_LEAST = 6  # ordinary instants at one tick: there is one more at every tick, and frames that come late
_MOST = 100  # ticks in which the last one may try to reach now: frames that are late throw it back
_Course = Generator[None, None, Replay | None]


class Search:
    """A search that is under way.

    Attributes:
        history: Whose past is played.
        is_done: It has ended.
        outcome: The replay until now of the one hypothesis that holds; None where there is none, or not yet.
        disagreeing: Sensors that do not agree with any state when all are heard.
    """

    def __init__(self, gate: Gate, health: Health, history: History) -> None:
        """Begin; the first piece is played when it is asked for."""
        self._gate, self._health, self.history = gate, health, history
        self.is_done, self.outcome = False, None
        self.disagreeing: frozenset[str] = frozenset()
        self._replays: list[Replay] = []  # that may be the outcome yet
        self._left = 0.0
        self._course = self._run(frozenset(gate.doubters))

    def advance(self) -> None:
        """Play a piece."""
        parts = self.history.now.parts
        m, n_x = sum(len(model.R) for model in parts.sensors.rows.values()), parts.layout.n_x
        self._cost = _OVERHEAD + (m + n_x) * n_x * (n_x + m)  # of an ordinary instant
        self._left = max(WORK, _SETUP + _LEAST * self._cost)
        try:
            next(self._course)
        except StopIteration as end:
            self.is_done, self.outcome = True, end.value

    def _run(self, doubters: frozenset[str]) -> _Course:
        start = self.history.oldest
        if self._gate.doubted_since > start and self._health.is_vouched(start):
            found = yield from self._leave_out(is_broad=False)
            for agreeing in (found, [replay for replay in found if replay.without in doubters]):
                if len(agreeing) == 1:
                    self.disagreeing = self._rivals(agreeing[0].without, found)
                    return None if self.disagreeing else (yield from self._catch_up(agreeing[0]))
            self._replays.clear()
        whole = self._begin("", is_broad=True)
        yield from self._play(whole, to_the_end=True)
        self.disagreeing = whole.disagreeing
        if whole.is_consistent:
            return (yield from self._catch_up(whole))
        self._replays.clear()
        found = yield from self._leave_out(is_broad=True)
        return (yield from self._catch_up(found[0])) if len(found) == 1 else None

    def _leave_out(self, is_broad: bool) -> Generator[None, None, list[Replay]]:
        """Leave out each sensor in turn; return the replays in which the others agree."""
        for name in heard_sensors(self.history.instants):
            replay = self._begin(name, is_broad)
            yield from self._play(replay)
            if not replay.is_consistent:
                self._replays.remove(replay)
        return list(self._replays)

    def _begin(self, without: str, is_broad: bool) -> Replay:
        instants, start = self.history.instants, self.history.instants[0].belief
        broad = Belief(start.x, instants[0].parts.process.P0)
        start = broad if is_broad else self._start_without(without, start)
        self._left -= _SETUP
        self._replays.append(Replay(self._gate.bound, instants, start, without))
        return self._replays[-1]

    def _start_without(self, name: str, start: Belief) -> Belief:
        """Return a belief without what a sensor may have said, all too slowly to be doubted, of its axes."""
        parts, P = self.history.instants[0].parts, start.P.copy()
        seen = np.flatnonzero(self._axes_told(name))
        for at in (seen + parts.layout.theta.start, seen + parts.layout.theta_dot.start):
            P[at, at] += parts.process.P0[at, at]
        return Belief(start.x, P)

    def _rivals(self, suspect: str, found: Iterable[Replay]) -> frozenset[str]:
        """Return a suspect and those without whom the others agree as well, and whom the state follows more.

        A state goes astray with whoever tells an axis best, and then it is the others who seem to be wrong.
        """
        own = self._axes_told(suspect)
        better = {r.without for r in found if np.any((own > 0.0) & (self._axes_told(r.without) > own))}
        return frozenset({suspect, *better} if better else ())

    def _axes_told(self, name: str) -> Array:
        """Return how well a sample tells each axis, ``1 / sigma^2``, (n_theta,)."""
        start = self.history.instants[0]
        model = start.parts.sensors.all()[name]
        H = model.jacobian(start.belief.x)[:, start.parts.layout.theta] * model.locates
        return np.asarray(np.sum(H * np.linalg.solve(model.R, H), axis=0))

    def _play(self, replay: Replay, to_the_end: bool = False) -> Generator[None, None, None]:
        while not replay.is_done and (to_the_end or replay.is_consistent):
            if self._left <= 0.0:
                yield
            self._advance(replay)

    def _catch_up(self, replay: Replay) -> _Course:
        """Let a replay go on until now; None when the others do not agree any more, or it takes too long."""
        self._replays[:] = [replay]
        for _ in range(_MOST):
            if self._left <= _SETUP:
                yield
            self._left -= _SETUP
            if not replay.follow(self.history.instants):
                replay = self._begin(replay.without, is_broad=True)
            self._advance(replay)
            if not replay.is_consistent:
                return None
            if replay.is_done:
                return replay
        return None

    def _advance(self, replay: Replay) -> None:
        """Compute what may be computed yet at this tick."""
        self._left -= self._cost * replay.advance(math.ceil(self._left / self._cost))
