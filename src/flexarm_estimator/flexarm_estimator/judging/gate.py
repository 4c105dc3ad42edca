"""The chi-square gate, with re-opening.

A sample is refused when ``nu' S^-1 nu`` is as improbable as ``gate`` sigmas. A gate alone would lock
a sensor out for ever after one impact: once a sensor has been refused ``reopen_after`` times in a
row, the state is doubted instead; its covariance is widened at that instant, for all sensors, and
the widening stays in the history so that a late camera frame does not undo it. Who has leapt farther than
its axis can move doubts nothing. When doubt returns within ``reopen_interval``, or another sensor refuses
what one alone has asked for, the state may not be to blame: there is a dispute, which ``exclusion`` settles.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import normalised_square
from flexarm_estimator.judging.chi_square import agreement_bound, chi_square_bound
from flexarm_estimator.judging.common_surprise import is_common
from flexarm_estimator.judging.meetings import Meetings
from flexarm_estimator.judging.ordinary import load_ordinary
from flexarm_estimator.judging.sample_judge import FAR, Verdict
from flexarm_estimator.judging.scan import Scan
from flexarm_estimator.judging.short_term import HELD, JUMP, LEAP, NOTHING, SHIFT, ShortTerm
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.steps.joint_step import PreparedStep
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_SHORTEST = 1e-3  # s
_KEPT = 9  # doubts in a row, at least
_SETTLING = 0.1  # s in which a state that a sensor has led back agrees with the others again
_TOGETHER = 2  # refusals in a row of several sensors at once that make the state doubtful


class Gate:
    """Judges samples and remembers what each sensor did lately.

    Attributes:
        is_disputed: The state was widened, and yet sensors contradict each other.
        doubts: Sensors whose refusals led to a widening, of every one of the last in a row.
        doubted_since: Stamp of the first refusal that led to the first of the widenings in a row [s].
    """

    def __init__(
        self,
        sigmas: Mapping[str, Sequence[float]],
        config: EstimatorConfig,
        use_compiler: bool = True,
        specs: Mapping[str, SensorSpec] | None = None,
    ) -> None:
        """Compute the thresholds.

        Args:
            sigmas: Noise of the channels of every sensor, SI.
            config: Settings.
            use_compiler: False judges without machine code: the same, slower.
            specs: What else is known of them; without it they are never slow, and leap nowhere.
        """
        self._code = load_ordinary() if use_compiler else None
        self._config, self._specs = config, specs or {}
        self._describe(sigmas)
        self.restart()

    @classmethod
    def of(cls, specs: Sequence[SensorSpec], config: EstimatorConfig, use_compiler: bool = True) -> Gate:
        """Return the gate of the sensors of a description."""
        sigmas = {spec.name: spec.sigma.tolist() for spec in specs}
        return cls(sigmas, config, use_compiler, {spec.name: spec for spec in specs})

    def restart(self) -> None:
        """Forget what the sensors did."""
        self._refusals = dict.fromkeys(self._sigmas, 0)
        self._refused_since = dict.fromkeys(self._sigmas, 0.0)
        gate, threshold = self._config.lone_gate or self._config.gate, self._threshold
        fastest = dict.fromkeys(self._sigmas, math.inf) | {n: s.velocity for n, s in self._specs.items()}
        self._past = {n: ShortTerm(s, gate, threshold[n], fastest[n]) for n, s in self._sigmas.items()}
        self._new = Meetings(self._past, self._code)
        self._released, self._dropped = list[Measurement](), list[Verdict]()
        self.doubts: list[set[str]] = []
        self._settled = -math.inf
        self.calm()

    def retune(self, specs: Iterable[SensorSpec]) -> None:
        """Go on with other noise of the same sensors; where they have other channels, anew."""
        before = {name: len(sigma) for name, sigma in self._sigmas.items()}
        self._describe({spec.name: spec.sigma.tolist() for spec in specs})
        if before != {name: len(sigma) for name, sigma in self._sigmas.items()}:
            self.restart()
        for name, past in self._past.items():
            past.retune(self._sigmas[name])

    def calm(self) -> None:
        """Take back all doubts: the state is what the sensors say."""
        self._refusals = dict.fromkeys(self._refusals, 0)
        self._reopened_at = -math.inf
        self.doubted_since = math.inf
        self.is_disputed = False

    @property
    def doubters(self) -> set[str]:
        """Sensors whose refusals led to the last widening."""
        return self.doubts[-1] if self.doubts else set()

    def bound(self, sensor: str) -> float:
        """Return what ``nu' S^-1 nu`` of a sensor may be."""
        return self._threshold[sensor]

    def agreement(self, sensor: str) -> float:
        """Return up to which ``nu' S^-1 nu`` a sensor that is not used agrees with those that are."""
        return self._agreement[sensor]

    def doubt(self, t: float) -> str:
        """Return who doubts the state; empty when nobody has lately."""
        return f"the state was doubted by {', '.join(sorted(self.doubters))}" if self.is_upset(t) else ""

    def needs(self, t: float) -> float:
        """Return since when the past is needed to settle the doubts of ``t`` [s]; infinite without any.

        Where doubts go on and on, not since the first: a past that only grew could soon not be played again.
        """
        config = self._config
        longest = t - config.history - config.reopen_interval
        return max(self.doubted_since, longest) if self.is_upset(t) else math.inf

    def meet(self, samples: Iterable[Measurement], scan: Scan | None = None) -> None:
        """Look at new samples before they are judged: a scan and single ones, in order of time."""
        self._new.meet(samples, scan)

    def take_ordinary(self, step: PreparedStep, t: float) -> list[Verdict] | None:
        """Judge and note what the run of a step has left at an instant ``t`` [s] whose rows are all new.

        Returns the verdicts; None, with nothing changed, when one of the samples wants a closer look.
        """
        stack = step.stack
        normalised = None if stack is None else self._new.take_ordinary(step, stack.names, t)
        if stack is None or normalised is None:
            return None
        for name in stack.names:
            self._refusals[name] = 0
        nu, said = step.nu.copy(), zip(stack.names, stack.spans, normalised, strict=True)
        return [Verdict(name, t, True, nu[span], z) for name, span, z in said]

    def judge(self, sensor: str, t: float, nu: Array, S: Array) -> Verdict:
        """Return the verdict on an innovation ``nu`` (m,) of covariance ``S`` (m, m); never raises."""
        return self.decide(sensor, t, nu, normalised_square(nu, S))

    def decide(self, sensor: str, t: float, nu: Array, nis: float) -> Verdict:
        """Return the verdict on an innovation ``nu`` (m,) with ``nis = nu' S^-1 nu``; never raises."""
        z = math.sqrt(nis / nu.size) if 0.0 <= nis < math.inf else 0.0
        met, reason, since = self._new.find(sensor, t), "", math.inf
        if met is not None:
            past, run = self._past[sensor], met[1]
            reason, since = past.doubt(run, nu, z), run.since
            if reason in (HELD, SHIFT):
                is_settling = reason == SHIFT and t < self._settled
                if is_settling or self.is_upset(t) or is_common(sensor, reason, self._past):
                    reason = ""
                elif reason == SHIFT:
                    since = past.mean.onset
        if not reason and not 0.0 <= nis <= self._threshold[sensor]:
            reason = LEAP if met is not None and self._past[sensor].has_leapt else FAR
        return Verdict(sensor, t, not reason, nu, z, reason, since)

    def has_doubt(self, verdicts: Iterable[Verdict], t: float) -> bool:
        """Return whether a refusal among ``verdicts`` is one too many: the state is wrong, not the sample."""
        return bool(self._find_doubters(verdicts))

    def note(self, verdicts: Iterable[Verdict]) -> None:
        """Count final verdicts."""
        for verdict in verdicts:
            sensor, t, is_accepted, nu, z, reason, _ = verdict
            if is_accepted:
                self._refusals[sensor] = 0
            elif reason == FAR:
                self.is_disputed |= self._contradicts(sensor) and self.is_upset(t)
                if not self._refusals[sensor]:
                    self._refused_since[sensor] = t
                self._refusals[sensor] += 1
            met = self._new.find(sensor, t)
            if met is None:
                continue
            self._new.end(sensor, met)
            doubt = "" if not reason or reason == FAR else reason
            outcome = self._past[sensor].note(met[1], met[0], nu, z, doubt, is_accepted)
            if outcome is not NOTHING:
                self._released += outcome.released
                self._dropped += [Verdict(sensor, s.t, False, nu, z, JUMP) for s in outcome.dropped]

    def resolve(self, oldest: float) -> tuple[list[Measurement], list[Verdict]]:
        """Return samples that were held and may be fused now, and verdicts on those that may not.

        Args:
            oldest: Only later samples can be fused [s].
        """
        if not (self._released or self._dropped):
            return [], []
        released = [sample for sample in self._released if sample.t > oldest + SAME_INSTANT]
        dropped, self._released, self._dropped = self._dropped, [], []
        return released, dropped

    def note_return(self, t: float) -> None:
        """Remember that a sensor that was silent has been fused at ``t`` [s].

        It moves a state that has drifted: what surprises the others then is no fault of theirs.
        """
        self._settled = max(self._settled, t + _SETTLING)

    def note_reopening(self, verdicts: Iterable[Verdict], t: float) -> tuple[set[str], float]:
        """Remember that the covariance was widened at ``t``; that does not help twice in a row.

        Returns:
            The sensors that doubt the state, and for how long the first of them has been refused [s]; of
            doubts in a row that of the first doubt: what moved the arm has done so since.
        """
        is_again = self.is_upset(t)
        self.is_disputed |= is_again
        doubters, self._reopened_at = self._find_doubters(verdicts), t
        self.doubts = [*self.doubts[-_KEPT:], doubters] if is_again else [doubters]
        since = min((self._refused_since[s] for s in doubters if self._refusals[s]), default=t)
        since = self.doubted_since = min(self.doubted_since, since) if is_again else since
        return set(doubters), max(t - since, _SHORTEST)

    def is_upset(self, t: float) -> bool:
        """Return whether the state has been doubted lately: innovations tell of it, not of their sensors."""
        return t - self._reopened_at < self._config.reopen_interval

    def _contradicts(self, sensor: str) -> bool:
        """Return whether a refusal is more than a spike: the second in a row of who speaks all the time."""
        return self._refusals[sensor] > 0 or (sensor in self._specs and self._specs[sensor].rate_hz > 0.0)

    def _describe(self, sigmas: Mapping[str, Sequence[float]]) -> None:
        """Take noise and number of the channels."""
        gate = self._config.gate
        self._threshold = {name: chi_square_bound(len(sigma), gate) for name, sigma in sigmas.items()}
        self._agreement = {name: agreement_bound(len(sigma), gate) for name, sigma in sigmas.items()}
        self._sigmas = sigmas

    def _find_doubters(self, verdicts: Iterable[Verdict]) -> set[str]:
        """Return who makes the state doubtful; soon after a doubt several that refuse at once do."""
        refused = {v.sensor: v.t for v in verdicts if v.reason == FAR}
        is_upset = any([self.is_upset(t) for t in refused.values()])
        together = {sensor for sensor in refused if is_upset or self._refusals[sensor] >= _TOGETHER}
        if len(together) > 1:
            return together
        return {sensor for sensor in refused if self._refusals[sensor] >= self._config.reopen_after}
