"""Computes one instant from the one before: predict, judge what is new, update.

Ordinary instants take the joint step; one with a refused row or a doubted state goes through filterpy,
and so do poses, which are linearised anew whenever their instant is computed. An instant that is
computed again because of a late sample keeps its verdicts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief, GuardedFilter, innovation_covariance
from flexarm_estimator.gate import Gate, Verdict
from flexarm_estimator.history import Instant
from flexarm_estimator.joint_step import JointStep, PreparedStep
from flexarm_estimator.process import ProcessModel
from flexarm_estimator.sensors import SensorModels
from flexarm_estimator.stack import Stack, StackedSample, stack_rows

Array = NDArray[np.float64]
_CACHE_SIZE = 512  # joint steps


class Fusion:
    """Process model, sensors, filter and gate of one served model."""

    def __init__(self, process: ProcessModel, models: SensorModels, gate: Gate) -> None:
        """Bind the parts; rows are stacked when a combination of sensors first occurs."""
        self._process, self._models, self._gate = process, models, gate
        self._poses = frozenset(models.poses)
        self._filter = GuardedFilter(process.system.n_x, process.system.n_u + 1)
        self._stacks: dict[tuple[str, ...], Stack] = {}
        self._steps: dict[tuple[float, tuple[str, ...]], JointStep] = {}

    def compute(self, before: Instant, instant: Instant) -> list[Verdict]:
        """Compute ``instant.belief``; return the verdicts on its pending samples, which it empties."""
        if not instant.pending and self._replay(before, instant):
            return []
        verdicts = None if instant.is_reopened else self._step_jointly(before, instant)
        if verdicts is None:
            verdicts = self._step_in_turn(before, instant)
        for name in self._models.poses:
            if name in instant.pending or name in instant.fused:
                verdicts += self._fuse_pose(name, instant)
        if not verdicts:
            return verdicts
        if not instant.is_reopened and self._gate.has_doubt(verdicts, instant.t):
            self._gate.note_reopening(verdicts, instant.t)
            instant.is_reopened = True
            return self.compute(before, instant)
        self._settle(instant, verdicts)
        return verdicts

    def _replay(self, before: Instant, instant: Instant) -> bool:
        """Compute an instant again that has rows only and is prepared; return whether it was so."""
        step = instant.prepared
        is_plain = not instant.is_reopened and self._poses.isdisjoint(instant.fused)
        if step is None or not is_plain or step.dt != instant.t - before.t:
            return False
        belief = step.apply(before.belief)
        if belief is not None:
            instant.belief = belief
        return belief is not None

    def _settle(self, instant: Instant, verdicts: list[Verdict]) -> None:
        """Keep what was accepted, drop what was not."""
        self._gate.note(verdicts)
        for verdict in verdicts:
            if verdict.is_accepted:
                instant.fused[verdict.sensor] = instant.pending[verdict.sensor]
            elif verdict.sensor in self._models.rows:
                instant.prepared = None
        instant.pending.clear()

    def _step_jointly(self, before: Instant, instant: Instant) -> list[Verdict] | None:
        """Predict and fuse all rows at once; None when a row is refused or rounding forbids it."""
        dt = instant.t - before.t
        step = instant.prepared
        has_new_rows = bool(instant.pending) and any(name in self._models.rows for name in instant.pending)
        if step is None or step.dt != dt or has_new_rows:
            step = instant.prepared = self._prepare(dt, instant)
        mean, J = step.predict(before.belief)
        verdicts: list[Verdict] = []
        if has_new_rows and step.stack is not None:
            verdicts = self._judge(step.stack, J[:, -1], J, instant)
            if not all([verdict.is_accepted for verdict in verdicts]):
                return None
        belief = step.condition(mean, J)
        if belief is None:
            return None
        instant.belief = belief
        return verdicts

    def _prepare(self, dt: float, instant: Instant) -> PreparedStep:
        transition = self._process.step(dt)
        names = tuple([k for k in self._models.rows if k in instant.fused or k in instant.pending])
        step = self._steps.get((transition.dt, names))
        if step is None:
            step = JointStep(transition, self._stack(names) if names else None)
            if len(self._steps) >= _CACHE_SIZE:
                self._steps.clear()
            self._steps[transition.dt, names] = step
        sample = StackedSample(step.stack, instant.fused | instant.pending) if step.stack else None
        return PreparedStep(dt, step, instant.u, sample)

    def _judge(self, stack: Stack, nu: Array, S: Array, instant: Instant) -> list[Verdict]:
        """Judge every pending row sensor by its own innovation, before any of them is fused."""
        return [
            self._gate.judge(name, instant.t, nu[span], S[span, span])
            for name, span in zip(stack.names, stack.spans, strict=True)
            if name in instant.pending
        ]

    def _step_in_turn(self, before: Instant, instant: Instant) -> list[Verdict]:
        """Predict and fuse with filterpy; leave out the rows that are refused."""
        transition = self._process.step(instant.t - before.t)
        prior = instant.belief = self._filter.predict(before.belief, transition, instant.u)
        if instant.is_reopened:
            prior = instant.belief = Belief(prior.x, prior.P + self._process.widening)
        samples = instant.fused | instant.pending
        names = tuple([name for name in self._models.rows if name in samples])
        if not names:
            return []
        sample = StackedSample(self._stack(names), samples)
        H, M = sample.stack.C, sample.stack.cross(transition)
        S = innovation_covariance(prior.P, H, sample.noise(), M)
        verdicts = self._judge(sample.stack, sample.innovation(prior.x, instant.u), S, instant)
        refused = [verdict.sensor for verdict in verdicts if not verdict.is_accepted]
        kept = tuple([name for name in names if name not in refused])
        if kept:
            sample = StackedSample(self._stack(kept), samples)
            nu, H, M = sample.innovation(prior.x, instant.u), sample.stack.C, sample.stack.cross(transition)
            instant.belief = self._filter.update(prior, nu, H, sample.noise(), M)
        return verdicts

    def _fuse_pose(self, name: str, instant: Instant) -> list[Verdict]:
        """Fuse the sample of one pose sensor; judge it if it is new."""
        model, belief = self._models.poses[name], instant.belief
        is_new = name in instant.pending
        sample = instant.pending[name] if is_new else instant.fused[name]
        nu, H = model.innovation(sample.y, belief.x, instant.u), model.jacobian(belief.x)
        R = model.R if sample.R is None else sample.R
        S = innovation_covariance(belief.P, H, R)
        verdicts = [self._gate.judge(name, sample.t, nu, S)] if is_new else []
        if all(verdict.is_accepted for verdict in verdicts):
            instant.belief = self._filter.update(belief, nu, H, R)
        return verdicts

    def _stack(self, names: tuple[str, ...]) -> Stack:
        if names not in self._stacks:
            rows = [self._models.rows[name] for name in names]
            self._stacks[names] = stack_rows(rows, self._process.force_cov)
        return self._stacks[names]
