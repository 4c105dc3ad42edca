"""A bag as a source: torque that the guard let through as input; gauges, accelerometers, encoders as outputs.

Everything is brought to even instants by its stamps, a sensor's less its ``stamp_delay``: samples by straight
lines, torques as they were held, also where one came too late for its period. A bag of a controlled arm is a
record under feedback: where its reference moves every axis, the accelerations asked for are the instruments
of Hc; else H1 tells plant and controller mixed, and a remark says so.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Bag, check_bag, decode
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.identify.acted_torque import acted
from flexarm_bringup.identify.measurement import COMMON, KIND_OF_UNIT, LEFT_OUT, Records, SourceError
from flexarm_bringup.identify.one_session import passed
from flexarm_bringup.replaying.replay_bag import configuration
from flexarm_bringup.topics import NAMESPACE
from flexarm_estimator.messages.inbox import TORQUE_TOPIC
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.sensors import output_names, output_units

Array = NDArray[np.float64]
NS = 1e-9
DESCRIPTION = "description"  # what a recorder of ours says
REFERENCE, JOINTS = "reference", "joint_states"
LONGEST_GAP = 0.1  # s; a channel with a longer one is left out
EXCITATION, TOLD = f"{NAMESPACE}/excitation", f"{NAMESPACE}/excite/test"  # of a modal test, and that it ended
UNENDED = (
    "a modal test was begun in this bag and did not come to its end: its torque counts as that of any bag, "
    "and what excited is not used as an instrument",
)


def read_bag(
    path: Path,
    described: ManipulatorConfig | None = None,
    otherwise: ManipulatorConfig | None = None,
    is_centred: bool = True,
) -> Records:
    """Return what a bag holds.

    Args:
        path: Its folder.
        described: The manipulator; None takes the description in the bag.
        otherwise: The manipulator where the bag does not say it, as of ``ros2 bag record``.
        is_centred: Outputs are told without their mean; False as they were, encoders where the axes were.

    Raises:
        SourceError: It cannot be used, or is of another arm; says why.
    """
    try:
        bag = check_bag(path, (f"{NAMESPACE}/joint_states",))
        if described is not None:
            _refuse_another_arm(bag, described)
        if described is None and DESCRIPTION not in bag.custom:
            described = otherwise
        config = described or configuration(bag)[0]
    except BagError as error:
        raise SourceError(str(error)) from error
    heard = listen(bag, config)
    outputs = {name: value for name, value in heard.items() if len(value[0]) > 1}
    axes = tuple(config.actuated)
    units = dict(zip(output_names(config), output_units(config), strict=True))
    spoken = {name: value for name, value in outputs.items() if name in units or name in axes}
    t = _instants(path, spoken, 1.0 / config.rate_hz)
    sampled = {
        name: np.interp(t, *values)
        for name, values in outputs.items()
        if units.get(name, LEFT_OUT[0]) not in LEFT_OUT and np.diff(values[0]).max() <= LONGEST_GAP
    }
    if not sampled:
        raise SourceError(f"{path}: no gauge, accelerometer or encoder without gaps over {LONGEST_GAP:g} s")
    known = all(axis in heard for axis in axes)
    inputs = {axis: held(t, *heard[axis]) for axis in axes} if known else {}
    asked = {
        axis: np.interp(t, *heard[f"{REFERENCE}.{axis}"], left=0.0, right=0.0)
        for axis in axes
        if f"{REFERENCE}.{axis}" in heard
    }
    moves = len(asked) == len(axes) and all(np.ptp(values) > 0.0 for values in asked.values())
    kinds = {name: KIND_OF_UNIT[units[name]] for name in sampled if units[name] in KIND_OF_UNIT}
    told = {name: values - values.mean() * is_centred for name, values in sampled.items()}
    left = _unended(bag) + _left_out(config, units, heard, told)
    return Records(
        config.rate_hz, inputs, told, COMMON, kinds, asked if moves else {}, is_held=True, remarks=left,
        is_centred=is_centred, is_of_moves=True,
    )  # fmt: skip


def _unended(bag: Bag) -> tuple[str, ...]:
    """Return what to say of a modal test that was interrupted; nothing where there is none."""
    names = {record.name for record in bag.records}
    return UNENDED if EXCITATION in names and TOLD not in names else ()


def _left_out(
    config: ManipulatorConfig,
    units: dict[str, str],
    heard: dict[str, tuple[Array, Array]],
    told: dict[str, Array],
) -> tuple[str, ...]:
    """Return which channels of the sensors that speak in every period are not there, and why."""
    prompt = [
        f"{spec.name}.{channel}" for spec in config.sensors if not spec.rate_hz for channel in spec.channels
    ]
    lines = []
    for name in prompt:
        if name in told or units.get(name, LEFT_OUT[0]) in LEFT_OUT:
            continue
        gap = float(np.diff(heard[name][0]).max(initial=0.0)) if name in heard else 0.0
        why = f"it was silent for {gap:.3g} s" if gap > LONGEST_GAP else "it says no number in the bag"
        lines.append(f"{name} is left out: {why}")
    return tuple(lines)


def refuse_bags_of_another_arm(paths: Sequence[Path], described: ManipulatorConfig) -> None:
    """Raise SourceError where one of the folders is a bag of another arm than the described one."""
    for path in paths:
        if path.is_dir():
            try:
                bag = check_bag(path, (f"{NAMESPACE}/joint_states",))
            except BagError as error:
                raise SourceError(str(error)) from error
            _refuse_another_arm(bag, described)


def _refuse_another_arm(bag: Bag, described: ManipulatorConfig) -> None:
    """Raise SourceError where a bag that says with which arm it was recorded is not of the described one.

    The same arm has the same actuated axes, and a sensor of the same name at least; values may differ.
    """
    try:
        recorded = configuration(bag)[0]
    except (BagError, ConfigError):  # a foreign bag, say: its messages show whether they fit
        return
    axes, names = ([*arm.actuated] for arm in (recorded, described))
    sensors, known = ({spec.name for spec in arm.sensors} for arm in (recorded, described))
    if axes != names or sensors.isdisjoint(known):
        told = [
            f"{arm.name} (axes {', '.join(arm.actuated)}; sensors {', '.join(s.name for s in arm.sensors)})"
            for arm in (recorded, described)
        ]
        raise SourceError(f"{bag.path}: recorded with {told[0]}, not with {told[1]}")


def listen(bag: Bag, config: ManipulatorConfig) -> dict[str, tuple[Array, Array]]:
    """Return times [s] and values of every channel, torque and asked acceleration by name, by stamp.

    Raises:
        SourceError: Stamps of the encoders go back or jump: the bag holds two sessions, say.
    """
    reader = SensorReader(config)
    topics = {f"{NAMESPACE}/{topic}": topic for topic in (*reader.topics, TORQUE_TOPIC, REFERENCE)}
    found: dict[str, dict[float, float]] = defaultdict(dict)
    measured: dict[str, dict[float, float]] = defaultdict(dict)
    newest = -np.inf
    for record in bag.records:
        topic = topics.get(record.name)
        if topic is not None:
            msg: Any = decode(record)
            t = stamp_to_ns(msg.header.stamp) * NS
            if topic == REFERENCE:
                _forget(found, msg, t)
            elif topic == JOINTS:
                newest = passed(bag.path, t, newest)
                _note_measured(measured, msg, t - 1.0 / config.rate_hz)
            hear = {TORQUE_TOPIC: _hear_torque, REFERENCE: _hear_reference}.get(topic, _hear_samples)
            for name, at, value in hear(reader, config, topic, msg, t):
                found[name][at] = value
    heard = {name: _sorted(values) for name, values in found.items() if values}
    for axis in config.actuated:
        if axis in heard and axis in measured:
            heard[axis] = acted(heard[axis], _sorted(measured[axis]), 1.0 / config.rate_hz)
    return heard


def _note_measured(measured: dict[str, dict[float, float]], msg: Any, t: float) -> None:
    """Note the torques that the drives measured, which acted from ``t`` on [s]."""
    for axis, value in zip(msg.name, msg.effort, strict=False):
        measured[axis][t] = value


def _forget(found: dict[str, dict[float, float]], msg: Any, t: float) -> None:
    """Forget what earlier references ask for from ``t`` on [s]: a new one is in force then."""
    for axis in msg.joint_names:
        asked = found[f"{REFERENCE}.{axis}"]
        for later in [each for each in asked if each >= t]:
            del asked[later]


Said = Iterator[tuple[str, float, float]]  # channel, time [s], value


def _hear_torque(reader: SensorReader, config: ManipulatorConfig, topic: str, msg: Any, t: float) -> Said:
    tau, _ = reader.read_torque(topic, msg)
    for axis, value in zip(config.actuated, [] if tau is None else tau, strict=False):
        yield axis, t, float(value)


def _hear_samples(reader: SensorReader, config: ManipulatorConfig, topic: str, msg: Any, t: float) -> Said:
    prompt = {spec.name: spec.channels for spec in config.sensors if not spec.rate_hz}
    for sample in StampDelays(config.sensors).undo(reader.read(topic, msg, t).samples):
        if sample.sensor in prompt and np.isfinite(sample.y).all():
            for channel, value in zip(prompt[sample.sensor], sample.y, strict=True):
                yield f"{sample.sensor}.{channel}", sample.t, float(value)


def _hear_reference(reader: SensorReader, config: ManipulatorConfig, topic: str, msg: Any, t: float) -> Said:
    for point in msg.points:
        later = t + point.time_from_start.sec + point.time_from_start.nanosec * NS
        for axis, value in zip(msg.joint_names, point.accelerations, strict=False):
            yield f"{REFERENCE}.{axis}", later, float(value)


def _sorted(values: dict[float, float]) -> tuple[Array, Array]:
    times = np.array(sorted(values))
    return times, np.array([values[t] for t in times])


def _instants(path: Path, outputs: dict[str, tuple[Array, Array]], dt: float) -> Array:
    """Return even instants at which every sensor and motor has spoken [s]."""
    if not outputs:
        raise SourceError(f"{path}: no sensor of this manipulator speaks in it")
    start = max(times[0] for times, _ in outputs.values())
    end = min(times[-1] for times, _ in outputs.values())
    n = int((end - start) / dt + 0.5)
    if n < 2:
        raise SourceError(f"{path}: its sensors hardly overlap in time: {start:.3f} to {end:.3f} s")
    return np.asarray(start + np.arange(n) * dt)


def held(t: Array, times: Array, values: Array) -> Array:
    """Return what was held from every instant on, (n,); zero before the first."""
    at = np.searchsorted(times, t + 1e-6, side="right") - 1
    return np.where(at >= 0, values[np.maximum(at, 0)], 0.0)
