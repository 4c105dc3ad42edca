"""The watch that names a channel at fault: flipped, detached, saturated, swapped.

Every tick costs a place in a ring and a look at the verdicts. Two inquiries (``inquiry``) investigate pieces
of the ring:

* the usual one when innovations are larger than they should be (``suspicion``), or a self-check is due;
* the close one, now and then, where the arm has moved most (``excitation``), with no more process noise than
  that window needs (``case``): a fault that drowns in it raises no suspicion.

Each has one tick in four, but those with late frames, for a few small pieces, and every one if it is urgent.
What a model error could say as well is told when a second window says the same (``second_opinion``).
A channel that was named is investigated again and again, and cleared when all is well with it. One whose sign
is flipped is cleared at once when ``_PLAIN`` samples in a row say what the others predict, which is far from
nothing and from the opposite: an arm at rest shows no more than that.

What the filter learns of the arm it has from the same channels: a suspicion is followed up with what had been
learned before it, and a state that is given up because of them takes nothing off the ring.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.exclusion.agreement import compare_at_stamp
from flexarm_estimator.isolation.case import Case
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_steps import load_steps
from flexarm_estimator.isolation.excitation import Excitation
from flexarm_estimator.isolation.hypotheses import FLIPPED, rearrangements
from flexarm_estimator.isolation.inquiry import Conclusion, Inquiry
from flexarm_estimator.isolation.isolation import say
from flexarm_estimator.isolation.second_opinion import BEYOND_CHANCE, CLOSE_BEYOND_CHANCE, SecondOpinion
from flexarm_estimator.isolation.suspicion import Suspicion
from flexarm_estimator.isolation.window import StepMaker
from flexarm_estimator.isolation.window_reading import Entry, entry_of
from flexarm_estimator.judging.short_term import HELD
from flexarm_estimator.judging.switched_channels import have_same_channels
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.watches.watch import Finding, View, Watch
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_KEPT = 180  # ticks in the ring
_LENGTH, _SHORTEST = 60, 36  # ticks of the longest window (0.3 s at 200 Hz) and of the shortest one
_ROUND, _CLOSE_TURN, _AT_ONCE = 4, 2, 4  # ticks; in one of them each inquiry does so many pieces
_ANEW, _REST = 30, 50  # ticks: at least that many of a close look are new; after one
_RESOLUTION = 1e-5  # s; periods that differ by less are one
_SELF_CHECK = 1.0  # s between investigations without suspicion
_EVERY = 2  # ticks between two looks at the verdicts
_PLAIN, _FAR = 10, 5.0  # samples; sigma of the prediction from zero, from which on a sign is plain
_GAP = 0.1  # s; after a longer one the ring is of another time


class IsolationWatch(Watch):
    """Names channels at fault."""

    def __init__(self, specs: Sequence[SensorSpec], errors: Mapping[str, float] | None = None) -> None:
        """Take the sensors of the arm, and for ``errors`` see ``Channels``."""
        self._specs, self._errors = tuple(specs), errors
        self._names: tuple[str, ...] | None = None
        load_steps()  # now, not in the middle of a motion
        self._forget(0.0)

    def use(self, parts: Parts) -> None:
        """See Watch."""
        self._parts = parts
        self._is_blind = not parts.steps.keeps_matrices  # hypotheses are run on the served model alone
        if self._names != tuple(parts.sensors.rows):
            self._names = tuple(parts.sensors.rows)
            self._channels = Channels(self._specs, self._names, self._errors)
            self._maker = StepMaker(_RESOLUTION, self._channels.most)
            self._excitation = Excitation(self._channels, _LENGTH)
            rearrangements(self._channels, self._channels.everybody)  # now, not in the middle of a motion
        self._learned = parts.layout.p

    def retune(self, specs: tuple[SensorSpec, ...]) -> None:
        """See Watch; the channels are made anew with the parts that follow."""
        if not have_same_channels(specs, self._specs):
            self._forget(0.0)
        self._specs, self._names = specs, None

    def _forget(self, t: float) -> None:
        """Begin anew at ``t`` [s]."""
        self._ring: deque[Entry] = deque(maxlen=_KEPT)
        self._usual = Inquiry(t, SecondOpinion(BEYOND_CHANCE), _AT_ONCE)
        self._close = Inquiry(t, SecondOpinion(CLOSE_BEYOND_CHANCE), _AT_ONCE)
        self._suspicion, self._ticks = Suspicion(), 0
        self._note_told()
        self._plain: dict[str, int] = {}
        self._rests_until = 0  # tick

    def restart(self, t: float) -> None:
        """See Watch."""
        if not self._ring or not 0.0 <= t - self._ring[-1].t <= _GAP:
            self._forget(t)
        elif self._faulty:
            for inquiry in (self._usual, self._close):
                inquiry.told.clear()
                inquiry.drop()
            self._note_told()

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch; with a filter that follows the arm far from its served model nothing can be said."""
        if self._is_blind:
            return ()
        x = view.belief.x
        learned = self._learned_before(x) if self._parts.layout.n_p else ()
        self._ring.append(entry_of(view, self._parts, learned, _not_held(view)))
        self._ticks += 1
        if self._ticks % _EVERY == 0:
            self._suspicion.note(view, self._ticks, self._channels.spans, self._blamed)
        self._excitation.tick(view.samples)
        plain = self._clear_signs(view) if self._faulty else []
        if plain:
            self._usual.drop()
            self._close.drop()
            return plain
        turn, found = self._ticks % _ROUND, []
        if turn == 0 or self._suspicion.first_tick or self._usual.is_urgent:
            found = self._inquire(view)
        if turn == _CLOSE_TURN or self._close.is_urgent:
            found = [*found, *self._look_closely(view)]
        return found

    @property
    def _checked(self) -> float:
        """Since when [s] the window began that was looked at last: a close look is a self-check, too."""
        usual = self._usual
        return usual.since if usual.told else max(usual.since, self._close.since)

    def _learned_before(self, x: Array) -> tuple[float, ...]:
        """Return what had been learned of the arm before there was any suspicion, (n_p,)."""
        return self._suspicion.learned_before(tuple(x[self._learned].tolist()), self._ticks)

    def _inquire(self, view: View) -> list[Finding]:
        """Go on with the usual inquiry."""
        if self._usual.is_busy:
            return self._go_on(self._usual, self._close, view)
        self._begin_usual(view.t)
        return []

    def _look_closely(self, view: View) -> list[Finding]:
        """Go on with the close one."""
        if not self._close.is_busy:
            self._begin_close(view.t)
            return []
        found = self._go_on(self._close, self._usual, view)
        if not self._close.is_busy:
            self._rests_until = self._ticks + _REST
        return found

    def _note_told(self) -> None:
        """Note what both inquiries have told by now: which channels are at fault, and which sensors."""
        self._told = self._usual.told + self._close.told
        self._faulty = frozenset(channel for told in self._told for channel in told.channels)
        self._blamed = {self._channels.all[channel].sensor for channel in self._faulty}

    def _go_on(self, inquiry: Inquiry, other: Inquiry, view: View) -> list[Finding]:
        """Go on with an investigation; what it finds is news for the ``other`` inquiry, too."""
        is_suspected = inquiry is self._usual and self._suspicion.first_tick > 0
        end = inquiry.go_on(view.t, is_suspected, self._has_frame(view))
        if end is None:
            return []
        other.drop()
        return self._report(end, inquiry.since)

    def _has_frame(self, view: View) -> bool:
        """Return whether a camera has said something, for which the past is computed again."""
        spans = self._channels.spans
        return any([sample.sensor not in spans for sample in view.samples])

    def _begin_usual(self, t: float) -> None:
        """Open an investigation of the newest window if there is reason and material for one."""
        if t < self._usual.next:
            return
        suspected = self._suspicion.first_tick
        first = max(suspected, self._usual.awaits(t))
        count = min(_LENGTH, self._ticks - first + 1) if first else _LENGTH
        is_due = first or t >= self._checked + _SELF_CHECK
        if is_due and _SHORTEST <= count <= len(self._ring):
            self._begin(self._usual, count, 0, Case(self._channels, self._faulty, self._maker, suspected > 0))

    def _begin_close(self, t: float) -> None:
        """Open an investigation of the window in which the arm has moved most since the one before."""
        if t < self._close.next:
            return
        awaited = self._close.awaits(t)
        if not awaited and self._ticks < self._rests_until:
            return
        earliest = max(self._close.last_tick + _ANEW, awaited + _LENGTH - 1)  # its last tick
        ago = self._excitation.find(self._ticks - earliest + 1)
        if ago is not None and len(self._ring) >= ago + _LENGTH:
            share = self._close.share
            case = Case(self._channels, self._faulty, self._maker, awaited > 0, is_close=True, share=share)
            self._begin(self._close, _LENGTH, ago, case)

    def _begin(self, inquiry: Inquiry, count: int, ago: int, case: Case) -> None:
        """Let the window of ``count`` ticks that ended so many ticks ``ago`` be investigated."""
        end = len(self._ring) - ago
        inquiry.begin(case, deque(islice(self._ring, end - count, end)), self._ticks - ago)

    def _clear_signs(self, view: View) -> list[Finding]:
        """Clear sensors of a flipped sign that plainly say what the others predict."""
        found = []
        for told in [told for told in self._told if told.words == FLIPPED]:
            name = self._channels.all[told.channels[0]].sensor
            for sample in view.samples:
                if sample.sensor == name:
                    self._plain[name] = self._count_plain(told.channels[0], sample, view)
            if self._plain.get(name, 0) >= _PLAIN:
                self._plain.pop(name)
                self._usual.forgive(told)
                self._close.forgive(told)
                found += self._report(Conclusion(told, is_told=False), view.t)
        return found

    def _count_plain(self, channel: int, sample: Measurement, view: View) -> int:
        """Return how many samples in a row have plainly had the right sign, this one included."""
        place = channel - self._channels.spans[sample.sensor].start
        nu, S = compare_at_stamp(sample, view.instants)
        sigma, before = math.sqrt(S[place, place]), self._plain.get(sample.sensor, 0)
        if abs(sample.y[place] - nu[place]) < _FAR * sigma:
            return before
        return before + 1 if abs(nu[place]) <= _FAR * sigma else 0

    def _report(self, end: Conclusion, since: float) -> list[Finding]:
        """Return what is found of the sensors of an explanation whose window began ``since`` [s]."""
        self._note_told()
        channels, blamed = self._channels, end.explanation.channels
        if end.is_told:
            self._suspicion.rest()
            told = [(channels.all[i].sensor, say(channels, i, end.explanation)) for i in blamed]
            return [Finding(sensor, words, is_fault=True, since=since) for sensor, words in told]
        cleared = {channels.all[i].sensor for i in blamed} - self._blamed
        return [Finding(sensor, "", is_fault=True) for sensor in sorted(cleared)]


def _not_held(view: View) -> Sequence[Measurement]:
    """Return the samples but those that wait for the next ones: most of these stand alone."""
    if view.is_ordinary:
        return view.samples
    held = [verdict.sensor for verdict in view.verdicts if verdict.reason == HELD]
    return [sample for sample in view.samples if sample.sensor not in held]
