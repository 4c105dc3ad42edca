"""The watch that names a channel at fault: flipped, detached, saturated, swapped.

Every tick costs a place in a ring and a look at the verdicts. When innovations are larger than they should
be, or a self-check is due, the ring is investigated (``investigation``): a small piece at every tick but
those with late frames, or several at every tick where somebody is suspected.
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

from flexarm_estimator.exclusion.agreement import compare
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_steps import load_steps
from flexarm_estimator.isolation.hypotheses import FLIPPED, rearrangements
from flexarm_estimator.isolation.investigation import Case, Investigation, investigate, reconsider
from flexarm_estimator.isolation.isolation import Explanation
from flexarm_estimator.isolation.second_opinion import SecondOpinion
from flexarm_estimator.isolation.window import StepMaker
from flexarm_estimator.isolation.window_reading import Entry
from flexarm_estimator.judging.short_term import HELD
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.watches.watch import Finding, View, Watch
from flexarm_model.manipulator.sensor_spec import SensorSpec

_LENGTH = 60  # ticks in the ring: 0.3 s at 200 Hz
_SHORTEST = 36  # ticks of the shortest window that is investigated
_RESOLUTION = 1e-5  # s; periods that differ by less are one
_SELF_CHECK = 1.0  # s between investigations without suspicion
_PAUSE = 0.03  # s between two investigations
_EVERY = 2  # ticks between two looks at the verdicts
_MEMORY = 0.9  # of the mean squared innovation from one look to the next
_MOST_OF_ONE = 100.0  # squared sigmas of one innovation
_PLAIN = 10  # samples
_FAR = 5.0  # sigma of the prediction from zero, from which on a sign is plain
_SUSPICIOUS = 1.5  # mean squared normalised innovation of a sensor
_BEFORE = 10  # ticks that something is wrong before it is suspected, at most
_DOUBT = 400  # ticks of a suspicion after which the arm is no longer what it was
_HASTE = 6  # pieces in one tick while somebody is suspected
_MOST_PUT_OFF = 3  # ticks in a row
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
            rearrangements(self._channels, self._channels.everybody)  # now, not in the middle of a motion
        self._theta, self._learned = parts.layout.theta, parts.layout.p
        self._is_learning = parts.layout.n_p > 0

    def _forget(self, t: float) -> None:
        """Begin anew at ``t`` [s]."""
        self._ring: deque[Entry] = deque(maxlen=_LENGTH)
        self._work: Investigation | None = None
        self._since = self._next = t
        self._told: list[Explanation] = []
        self._reconsidered: Explanation | None = None
        self._opinion, self._last_tick = SecondOpinion(), 0  # that of the window at hand
        self._squares: dict[str, float] = {}
        self._plain: dict[str, int] = {}
        self._put_off = 0  # ticks in a row
        self._ticks = self._suspected = 0  # the first tick of the present suspicion; 0 without
        self._known: deque[tuple[float, ...]] = deque(maxlen=_BEFORE)  # learned, without suspicion

    def restart(self, t: float) -> None:
        """See Watch."""
        if not self._ring or not 0.0 <= t - self._ring[-1].t <= _GAP:
            self._forget(t)
        elif self._told:
            self._told, self._work, self._reconsidered = [], None, None

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch; with a filter that follows the arm far from its served model nothing can be said."""
        if self._is_blind:
            return ()
        theta = view.belief.x[self._theta].copy()
        learned = self._learned_before(view) if self._is_learning else ()
        self._ring.append(Entry(view.t, view.u, theta, learned, _not_held(view), self._parts))
        self._ticks += 1
        if self._ticks % _EVERY == 0:
            self._note(view)
        plain = self._clear_signs(view) if self._told else []
        if plain:
            self._work, self._reconsidered = None, None
            return plain
        if self._work is None:
            self._begin(view.t)
            return ()
        return self._go_on(self._work, view)

    def _go_on(self, work: Investigation, view: View) -> list[Finding]:
        """Do a piece of the investigation: several if it is urgent, else none beside a late frame."""
        self._case.is_urgent |= self._suspected > 0
        if not self._case.is_urgent and self._put_off < _MOST_PUT_OFF and self._has_frame(view):
            self._put_off += 1
            return []
        self._put_off = 0
        pieces = 0
        try:
            while pieces < (_HASTE if self._case.is_urgent else 1):
                next(work)
                pieces += 1
        except StopIteration as end:
            self._work = None
            self._next = view.t + _PAUSE
            return self._conclude(end.value)
        return []

    def _has_frame(self, view: View) -> bool:
        """Return whether a camera has said something, for which the past is computed again."""
        spans = self._channels.spans
        return any([sample.sensor not in spans for sample in view.samples])

    def _learned_before(self, view: View) -> tuple[float, ...]:
        """Return what had been learned of the arm before there was any suspicion, (n_p,)."""
        if not self._suspected or self._ticks - self._suspected > _DOUBT or not self._known:
            self._known.append(tuple(view.belief.x[self._learned].tolist()))
        return self._known[0]

    def _note(self, view: View) -> None:
        squares = self._squares
        for sensor, _, _, _, normalised, _, _ in view.verdicts:
            square = normalised**2
            square = square if square < _MOST_OF_ONE else _MOST_OF_ONE
            squares[sensor] = square + _MEMORY * (squares.get(sensor, 0.0) - square)
        if len(view.verdicts) < len(view.samples):
            self._note_unheard(view)
        is_suspicious = max(squares.values(), default=0.0) >= _SUSPICIOUS
        self._suspected = (self._suspected or self._ticks) if is_suspicious else 0

    def _note_unheard(self, view: View) -> None:
        """Suspect the sensors that something else has put out of use."""
        heard = {verdict.sensor for verdict in view.verdicts}
        known = {self._channels.all[channel].sensor for told in self._told for channel in told.channels}
        for sample in view.samples:
            if sample.sensor in self._channels.spans and sample.sensor not in heard | known:
                self._squares[sample.sensor] = 2.0 * _SUSPICIOUS

    def _begin(self, t: float) -> None:
        """Open an investigation if there is reason and material for one."""
        self._opinion.expire(t)
        first = max(self._suspected, self._opinion.first_tick)
        count = min(_LENGTH, self._ticks - first + 1) if first else _LENGTH
        is_due = first or t >= self._since + _SELF_CHECK
        if t < self._next or not is_due or not _SHORTEST <= count <= len(self._ring):
            return
        entries = self._ring.copy()
        for _ in range(len(entries) - count):
            entries.popleft()
        self._since, self._last_tick = entries[0].t, self._ticks
        faulty = frozenset(channel for told in self._told for channel in told.channels)
        case = self._case = Case(self._channels, faulty, self._maker, self._suspected > 0)
        self._reconsidered = self._told[0] if self._told and self._reconsidered is None else None
        if self._reconsidered is None:
            self._work = investigate(case, entries)
        else:
            self._work = reconsider(case, entries, self._reconsidered)

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
                self._told.remove(told)
                found += [Finding(sensor, "", is_fault=True) for sensor in self._sensors(told)]
        return found

    def _count_plain(self, channel: int, sample: Measurement, view: View) -> int:
        """Return how many samples in a row have plainly had the right sign, this one included."""
        place = channel - self._channels.spans[sample.sensor].start
        nu, S = compare(sample, view.belief, view.u, self._parts)
        sigma, before = math.sqrt(S[place, place]), self._plain.get(sample.sensor, 0)
        if abs(sample.y[place] - nu[place]) < _FAR * sigma:
            return before
        return before + 1 if abs(nu[place]) <= _FAR * sigma else 0

    def _conclude(self, explanation: Explanation | None) -> list[Finding]:
        if explanation is None:
            if self._reconsidered is not None:  # the next one first, the next time
                self._told = [*self._told[1:], *self._told[:1]]
            return []
        if self._reconsidered is not None:
            self._told.remove(explanation)
            return [Finding(sensor, "", is_fault=True) for sensor in self._sensors(explanation)]
        if not self._opinion.agrees(explanation, self._ring[-1].t, self._last_tick):
            return []
        self._told.append(explanation)
        self._squares.clear()
        return [
            Finding(self._channels.all[channel].sensor, self._say(channel, explanation), True, self._since)
            for channel in explanation.channels
        ]

    def _sensors(self, explanation: Explanation) -> list[str]:
        still = {channel for told in self._told for channel in told.channels}
        names = {self._channels.all[channel].sensor for channel in explanation.channels}
        return sorted(names - {self._channels.all[channel].sensor for channel in still})

    def _say(self, channel: int, explanation: Explanation) -> str:
        channels = self._channels.all
        own, others = channels[channel], [channels[i] for i in explanation.channels if i != channel]
        is_whole = len(others) > 1
        names = [other.sensor if is_whole else f"{other.sensor} {other.name}".strip() for other in others]
        partner = " ".join(dict.fromkeys(name for name in names if not is_whole or name != own.sensor))
        words = explanation.words.format(partner)
        said = f"{words} ({explanation.total:.0f} squared sigmas better explained than by a sound sensor)"
        return f"{own.name}: {said}" if own.name and not is_whole else said


def _not_held(view: View) -> Sequence[Measurement]:
    """Return the samples but those that wait for the next ones: most of these stand alone."""
    if view.is_ordinary:
        return view.samples
    held = [verdict.sensor for verdict in view.verdicts if verdict.reason == HELD]
    return [sample for sample in view.samples if sample.sensor not in held]
