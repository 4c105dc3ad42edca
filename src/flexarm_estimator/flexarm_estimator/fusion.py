"""Computes one instant from the one before: predict, judge what is new, update.

Ordinary instants take the joint step, one with a refused row or a doubted state goes through filterpy.
Matrices are the filter's choice (``filters.step_source``), tangents are taken when an instant is computed.
Computed again because of a late sample it keeps its verdicts; ordinary ones in a row go in one go.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy

import numpy as np

from flexarm_estimator.filter import Belief, GuardedFilter, innovation_covariance
from flexarm_estimator.filters.served import ServedSteps
from flexarm_estimator.filters.step_source import StepSource
from flexarm_estimator.history import Instant
from flexarm_estimator.judging.reopening import SIZES, Reopening
from flexarm_estimator.judging.repeats import REPEATING
from flexarm_estimator.judging.sample_judge import SampleJudge, Verdict
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import SensorModels
from flexarm_estimator.state.state_limits import StateLimits
from flexarm_estimator.steps.joint_step import PreparedStep
from flexarm_estimator.steps.joint_step_cache import JointStepCache
from flexarm_estimator.steps.pose_update import PoseUpdate
from flexarm_estimator.steps.stack import StackedSample
from flexarm_estimator.steps.step_runner import make_runner

_AGREED = 1.0  # sigma


class Fusion:
    """Process model, sensors, filter and gate of one served model.

    Attributes:
        widen: Gives what is added to the covariance where the state is doubted, (n_x, n_x).
        dependent: See ``StepSource``.
        poses: Sensors that are fused one by one, after all rows.
    """

    def __init__(
        self,
        process: ProcessModel,
        models: SensorModels,
        gate: SampleJudge,
        use_compiler: bool = True,
        steps: StepSource | None = None,
    ) -> None:
        """Bind the parts; ``steps`` is the filter, the linear one if None."""
        self._source = ServedSteps(process, models) if steps is None else steps
        self._models, self._gate, self.widen = models, gate, process.widen
        self._limits = StateLimits(process.limits)
        self.poses, self.dependent = frozenset(models.poses), self._source.dependent
        n_x = process.system.n_x
        poses = {name: len(model.R) for name, model in models.poses.items()}
        widest = max(sum(len(model.R) for model in models.rows.values()), *poses.values(), 1)
        self._runner = make_runner(n_x, widest, use_compiler, self._limits)
        self._pose_updates = {name: PoseUpdate(name, m, n_x, self._runner) for name, m in poses.items()}
        self._filter = GuardedFilter(n_x, process.system.n_u + 1)
        self._steps = JointStepCache(self._source, models.rows)

    def compute(self, instants: Sequence[Instant], first: int, end: int) -> list[Verdict]:
        """Compute the beliefs of ``instants[first:end]``, all of this model; ``first`` >= 1.

        Returns:
            The verdicts on their pending samples, which it empties.
        """
        verdicts: list[Verdict] = []
        i = first
        while i < end:
            i += 0 if instants[i].pending else self._replay(instants, i, end)
            if i < end:
                before, instant = instants[i - 1], instants[i]
                is_stepped = i == first and self._lacks_only_poses(before, instant)
                verdicts += self._compute_one(before, instant, is_stepped)
                self._limits.hold(instant.belief)
                i += 1
        return verdicts

    def judged_by(self, gate: SampleJudge) -> Fusion:
        """Return the same with another judge."""
        other = copy(self)
        other._gate = gate
        return other

    def prepare(self, before: Belief, dt: float, instant: Instant) -> PreparedStep:
        """Return the joint step from ``before`` over ``dt`` [s] to an instant and all its rows."""
        samples = {**instant.fused, **instant.pending} if instant.fused else instant.pending
        u = instant.inputs = self._source.inputs(before, dt, instant.u)
        step = self._steps.step(before, dt, u, samples)
        sample = StackedSample(step.stack, samples, instant.scan) if step.stack else None
        return PreparedStep(dt, step, u, sample)

    def _replay(self, instants: Sequence[Instant], first: int, end: int) -> int:
        """Compute instants in a row again that have only rows, all of them known; return how many."""
        if not self._source.is_constant:
            return 0
        steps, poses = list[PreparedStep](), self.poses
        start, t = instants[first - 1].belief, instants[first - 1].t
        for instant in instants[first:end]:
            if instant.pending or instant.reopening is not None or not instant.fused.keys().isdisjoint(poses):
                break
            step, dt = instant.prepared, instant.t - t
            if step is None or step.dt != dt:
                step = instant.prepared = self.prepare(start, dt, instant)
            steps.append(step)
            t = instant.t
        if not steps:
            return 0
        done = self._runner.run(start, steps)
        for instant, step in zip(instants[first : first + done], steps, strict=False):
            instant.belief = step.belief
        if done:
            self._limits.hold(steps[done - 1].belief)  # where one was left the run has ended
        return done

    def _lacks_only_poses(self, before: Instant, instant: Instant) -> bool:
        """Return whether the belief is that of all rows already, given that ``before`` has not changed."""
        step = instant.prepared
        if step is None or instant.is_reopened or step.dt != instant.t - before.t or not instant.pending:
            return False
        return self.poses.issuperset(instant.pending) and self.poses.isdisjoint(instant.fused)

    def _compute_one(self, before: Instant, instant: Instant, is_stepped: bool = False) -> list[Verdict]:
        """Compute one instant; ``is_stepped`` leaves out the step to it, which has been done."""
        step = None if is_stepped or instant.reopening is not None else self._run_rows(before, instant)
        if step is not None and (ordinary := self._take_ordinary(step, instant)) is not None:
            return ordinary
        verdicts = self._judge_one(before, instant, is_stepped, step)
        if verdicts and not instant.is_reopened and self._gate.has_doubt(verdicts, instant.t):
            verdicts = self._reopen(before, instant, verdicts)
        self._settle(instant, verdicts)
        return verdicts

    def _reopen(self, before: Instant, instant: Instant, verdicts: list[Verdict]) -> list[Verdict]:
        """Widen the covariance until those that doubted the state agree with it."""
        doubters, age = self._gate.note_reopening(verdicts, instant.t)
        for size in SIZES:
            instant.reopening = Reopening(size, age)
            verdicts = self._judge_one(before, instant)
            if all(v.is_accepted and v.normalised <= _AGREED for v in verdicts if v.sensor in doubters):
                break
        return verdicts

    def _take_ordinary(self, step: PreparedStep, instant: Instant) -> list[Verdict] | None:
        """Settle an instant all of whose samples are new rows; None when one wants a closer look."""
        pending = instant.pending
        if step.stack is None or instant.fused or len(pending) != len(step.stack.names):
            return None
        verdicts = self._gate.take_ordinary(step, instant.t)
        if verdicts is not None:
            instant.accept(step.belief)
        return verdicts

    def _judge_one(
        self, before: Instant, instant: Instant, is_stepped: bool = False, step: PreparedStep | None = None
    ) -> list[Verdict]:
        """Judge what is new at an instant after the run ``step`` of its rows; None goes there in turn."""
        verdicts = self._judge_run(step, instant) if step else [] if is_stepped else None
        verdicts = self._step_in_turn(before, instant) if verdicts is None else verdicts
        for name in self._models.poses:
            if name in instant.pending or name in instant.fused:
                self._limits.hold(instant.belief)  # as where the pose comes late, to rows that were held
                verdicts += self._fuse_pose(name, instant)
        return verdicts

    def _settle(self, instant: Instant, verdicts: list[Verdict]) -> None:
        """Keep what was accepted, drop what was not."""
        self._gate.note(verdicts)
        for sensor, _, is_accepted, _, _, reason, _ in verdicts:
            if is_accepted:
                instant.fused[sensor] = instant.pending[sensor]
            elif reason not in REPEATING:
                instant.refused[sensor] = instant.pending[sensor]
            if not is_accepted and sensor in self._models.rows:
                instant.prepared = None
        instant.pending.clear()

    def _run_rows(self, before: Instant, instant: Instant) -> PreparedStep | None:
        """Predict and fuse all rows at once, nothing being refused; None when rounding forbids it."""
        dt = instant.t - before.t
        step = instant.prepared
        is_old = step is not None and step.dt == dt and self.poses.issuperset(instant.pending)
        if step is None or not is_old or not self._source.is_constant:
            step = instant.prepared = self.prepare(before.belief, dt, instant)
        return step if self._runner.run(before.belief, (step,)) else None

    def _judge_run(self, step: PreparedStep, instant: Instant) -> list[Verdict] | None:
        """Judge pending rows by what the run has left, and take its belief; None if one is refused."""
        verdicts = []
        if step.stack is not None:
            nu, nis, t = step.nu.copy(), step.nis.tolist(), instant.t
            for name, span, square in zip(step.stack.names, step.stack.spans, nis, strict=True):
                if name in instant.pending:
                    verdicts.append(self._gate.decide(name, t, nu[span], square))
        if not all([verdict.is_accepted for verdict in verdicts]):
            return None
        instant.belief = step.belief
        return verdicts

    def _step_in_turn(self, before: Instant, instant: Instant) -> list[Verdict]:
        """Predict and fuse with filterpy; leave out the rows that are refused."""
        start, dt = before.belief, instant.t - before.t
        u = instant.inputs = self._source.inputs(start, dt, instant.u)
        transition = self._source.transition(start, dt, u).at(start.x, u)
        prior = instant.belief = self._filter.predict(start, transition, u)
        if instant.reopening is not None:
            prior = instant.belief = Belief(prior.x, prior.P + self.widen(instant.reopening))
        samples = instant.fused | instant.pending
        names = tuple([name for name in self._models.rows if name in samples])
        if not names:
            return []
        sample = StackedSample(self._source.rows(names, prior, u).at(prior.x, u), samples)
        H, M = sample.stack.C, sample.stack.cross(transition)
        S = innovation_covariance(prior.P, H, sample.noise(), M)
        nu = sample.innovation(prior.x, u)
        verdicts = [  # every pending sensor by its own innovation, before any of them is fused
            self._gate.judge(name, instant.t, nu[span], S[span, span])
            for name, span in zip(sample.stack.names, sample.stack.spans, strict=True)
            if name in instant.pending
        ]
        refused = [verdict.sensor for verdict in verdicts if not verdict.is_accepted]
        kept = tuple(name for name in names if name not in refused)
        if kept:
            sample = StackedSample(self._source.rows(kept, prior, u).at(prior.x, u), samples)
            nu, H, M = sample.innovation(prior.x, u), sample.stack.C, sample.stack.cross(transition)
            instant.belief = self._filter.update(prior, nu, H, sample.noise(), M)
        return verdicts

    def _fuse_pose(self, name: str, instant: Instant) -> list[Verdict]:
        """Fuse the sample of one pose sensor; judge it if it is new."""
        model, belief = self._models.poses[name], instant.belief
        is_new = name in instant.pending
        sample = instant.pending[name] if is_new else instant.fused[name]
        R, y, u = model.R if sample.R is None else sample.R, sample.y, instant.u
        try:
            nis, updated, (nu, H, spread) = self._pose_updates[name].fit(
                belief, lambda about: self._source.look(model, y, about, u), R, self._gate.bound(name)
            )
        except ValueError:  # loops do not close where the state is said to be
            return [self._gate.decide(name, sample.t, np.zeros(y.size), math.inf)] if is_new else []
        verdicts = [self._gate.decide(name, sample.t, nu, nis)] if is_new else []
        if all([verdict.is_accepted for verdict in verdicts]):
            instant.belief = updated or self._filter.update(belief, nu, H, R + spread)
        return verdicts
