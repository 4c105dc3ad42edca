"""A modal test of a rig: check its sensors, excite it within its limits, return the records."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.excite.drive import Channel, Drive, Driven, channels
from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.excite.plan import Plan
from flexarm_bringup.identify.measurement import COMMON, Records, SourceError
from flexarm_model.identification.channel_findings import ANOTHER_ARM, CheckedChannel, Finding, Pushes
from flexarm_model.identification.noise_floor import noise_floor
from flexarm_model.identification.sensor_check import check_channels
from flexarm_model.manipulator.description import ManipulatorConfig

Array = NDArray[np.float64]
QUIET = 1.0  # s
SHAKEN = 2000  # periods; in the second half the arm shakes as it goes on
CYCLES_SEEN = 1.0  # of the slowest mode after a push: a softer arm is still in step with the model
FELT = "m/s^2"  # unit of what feels gravity at rest
STANDARD_GRAVITY = 9.80665  # m/s^2
TILT = 0.2  # share of it that a sound one may be off by, beyond its bias: 12 degrees
MOST_GAPS = 0.05  # share of missing samples that is bridged


class SensorCheckError(SourceError):
    """Channels cannot be used; the message names them.

    Attributes:
        findings: Of all channels.
        axes: Whose pushes they answered to.
    """

    def __init__(self, text: str, findings: tuple[Finding, ...], axes: tuple[str, ...]) -> None:
        """Keep what was found."""
        super().__init__(text)
        self.findings, self.axes = findings, axes


@dataclass(frozen=True)
class MeasuredTest:
    """A modal test.

    Attributes:
        axes: Names of the motors.
        plan: What was done.
        findings: Of the sensor check, one per channel.
        records: One per run, with channels that may be used.
    """

    axes: tuple[str, ...]
    plan: Plan
    findings: tuple[Finding, ...]
    records: tuple[Records, ...]


Steps = Generator[Array, Driven, MeasuredTest]
"""A modal test as stretches of time: yields torques to add, (n, n_theta), is sent what happened."""


def measure(drive: Drive, plan: Plan, ignore: Sequence[str], say: Callable[[str], None]) -> MeasuredTest:
    """Do a modal test at once; see ``modal_test``."""
    steps = modal_test(drive.arm, plan, ignore, say)
    added = next(steps)
    while True:
        try:
            added = steps.send(drive.run(added))
        except StopIteration as end:
            tested: MeasuredTest = end.value
            return tested


def modal_test(arm: HeldArm, plan: Plan, ignore: Sequence[str], say: Callable[[str], None]) -> Steps:
    """Check the sensors, excite the arm, return the records.

    Args:
        arm: That is held and excited.
        plan: What to do.
        ignore: Channels that may be wrong: they are left out.
        say: Is told what is being done.

    Raises:
        SensorCheckError: A channel is dead, flipped, swapped, silent, clipped or off at rest, and is not to
            be ignored; or no channel answers as the described arm should.
    """
    used = channels_used(arm.config, ignore)
    say("sensor check")
    findings = yield from check_sensors(arm, plan)
    axes = arm.model.theta_names
    refuse(findings, {c.name for c in used}, axes)
    records = []
    for run in range(len(plan.signs)):
        say(f"run: {run + 1} of {len(plan.signs)}, {plan.seconds / len(plan.signs):.0f} s each")
        driven = yield plan.added(run)
        records.append(record_of(arm.config, driven, plan, used))
    return MeasuredTest(axes, plan, findings, tuple(records))


def channels_used(config: ManipulatorConfig, ignore: Sequence[str]) -> tuple[Channel, ...]:
    """Return the channels that are not to be left out.

    Raises:
        SourceError: One that is to be left out does not exist, or none would be left.
    """
    every = channels(config)
    unknown = sorted(set(ignore) - {name for channel in every for name in (channel.name, channel.spec.name)})
    if unknown:
        names = ", ".join(channel.name for channel in every)
        raise SourceError(f"channel to ignore: {', '.join(unknown)}: not one of {names}")
    used = tuple(c for c in every if not {c.name, c.spec.name} & set(ignore))
    if not used:
        raise SourceError(
            f"{config.name}: no encoder, gauge or accelerometer that samples in every period"
            + (f" is left without {', '.join(ignore)}" if every else "; modes cannot be identified")
        )
    return used


def check_sensors(arm: HeldArm, plan: Plan) -> Generator[Array, Driven, tuple[Finding, ...]]:
    """Return what is to be said of every channel, from a quiet stretch and a push of every motor."""
    every, dt, m = channels(arm.config), arm.dt, arm.model.n_theta
    push, rest = push_of(arm), np.zeros((round(arm.settling_time / dt), m))
    added = [np.outer(push, row) * plan.amplitude for row in np.eye(m)]
    predicted = [arm.pushed(each)[:, [c.row for c in every]] for each in added]
    yield rest
    quiet = (yield np.zeros((max(round(QUIET / dt), 50), m))).y
    before, answers = [], []
    for each in added:
        start = (yield np.zeros((10, m))).y
        answers.append((yield each).y)
        before.append(_mean_of_what_is_told(np.vstack([start, answers[-1][:1]])))
        yield rest
    at_rest = np.array(before)
    measured = np.array(answers) - at_rest[:, None]
    shaken = arm.shaken(SHAKEN)[SHAKEN // 2 :]
    checked = [_checked(c, noise_floor(shaken[:, c.row]), float(arm.model.outputs.y0[c.row])) for c in every]
    return check_channels(checked, Pushes(quiet, at_rest, measured, np.array(predicted)))


def _mean_of_what_is_told(y: Array) -> Array:
    """Return the mean of every channel over the rows (k, n_y) in which it says something, or zero, (n_y,)."""
    told = np.isfinite(y)
    return np.asarray(np.where(told, y, 0.0).sum(axis=0) / np.maximum(told.sum(axis=0), 1))


def push_of(arm: HeldArm) -> Array:
    """Return one cycle of a sine near the slowest mode and the time after it, with peak 1, (n,)."""
    f_hz = float(abs(arm.elastic_poles[0])) / (2 * np.pi)
    n = round((1.0 + CYCLES_SEEN) / f_hz / arm.dt)
    t = np.arange(n) * arm.dt
    return np.asarray(np.where(t * f_hz < 1.0, np.sin(2 * np.pi * f_hz * t), 0.0))


def refuse(findings: tuple[Finding, ...], used: Collection[str], axes: tuple[str, ...]) -> None:
    """Refuse to go on with channels that cannot be used.

    Raises:
        SensorCheckError: Names them, and what is wrong with them.
    """
    bad = [finding for finding in findings if finding.is_refused and finding.name in used]
    arm = [finding for finding in bad if finding.verdict == ANOTHER_ARM]
    if arm:
        raise SensorCheckError(f"{arm[0].words}. No sensor is to blame; correct that first", findings, axes)
    if bad:
        named = "; ".join(f"{finding.name} is {finding.verdict}: {finding.words}" for finding in bad)
        allow = " ".join(f"--ignore-channel {finding.name}" for finding in bad)
        raise SensorCheckError(f"{named}. Repair it, or leave it out with {allow}", findings, axes)


def _checked(channel: Channel, shaken: float, standing: float) -> CheckedChannel:
    spec, allowance = channel.spec, np.inf
    if channel.unit == FELT:
        allowance = TILT * STANDARD_GRAVITY + (spec.bias.limit if spec.bias else 0.0)
    return CheckedChannel(
        channel.name, channel.unit, channel.sigma, spec.low, spec.high, shaken, standing, allowance
    )


def record_of(config: ManipulatorConfig, driven: Driven, plan: Plan, used: Sequence[Channel]) -> Records:
    """Return the periods after the start as a record."""
    repeats, axes, every = plan.excitation.signal.size, tuple(config.actuated), channels(config)
    begin = plan.skipped * repeats
    outputs = {
        channel.name: bridged(driven.y[begin:, every.index(channel)], channel.name) for channel in used
    }
    return Records(
        plan.excitation.rate_hz,
        dict(zip(axes, driven.tau[begin:].T, strict=True)),
        outputs,
        COMMON,
        {channel.name: channel.kind for channel in used if channel.kind != COMMON},
        dict(zip(axes, driven.added[begin:].T, strict=True)),
        repeats,
        True,
        plan.excitation.band_hz,
        is_centred=True,
    )


def bridged(y: Array, name: str) -> Array:
    """Return a channel with its gaps filled by straight lines, less its mean, (n,).

    Raises:
        SourceError: Too much is missing.
    """
    known = np.isfinite(y)
    if np.mean(~known) > MOST_GAPS:
        raise SourceError(f"{name}: {100 * np.mean(~known):.0f} % of its samples are missing")
    index = np.arange(y.size)
    filled = np.interp(index, index[known], y[known])
    return np.asarray(filled - filled.mean())
