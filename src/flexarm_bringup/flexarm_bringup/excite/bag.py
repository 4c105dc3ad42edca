"""The modal test in a bag: what an excite node did, brought to the instants of its runs by the stamps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Bag, check_bag, decode
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.excite.acted_excitation import acted_excitation
from flexarm_bringup.excite.drive import Channel, Driven, channels
from flexarm_bringup.excite.measure import MeasuredTest, SensorCheckError, channels_used, record_of
from flexarm_bringup.excite.told import ToldTest, from_text
from flexarm_bringup.identify.bag_source import EXCITATION, LONGEST_GAP, NS, TOLD, held, listen
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.replaying.replay_bag import configuration
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig

Array = NDArray[np.float64]
Heard = Mapping[str, tuple[Array, Array]]  # times [s] and values by name
COMMANDS = f"{NAMESPACE}/joint_commands"


def read_test(path: Path) -> MeasuredTest | None:
    """Return the modal test in a bag; None where it holds none that came to its end.

    Raises:
        SensorCheckError: The test refused its sensors.
        SourceError: The bag cannot be used.
    """
    try:
        bag = check_bag(path)
        texts = [decode(record).data for record in bag.records if record.name == TOLD]
        if not texts:
            return None
        told, config = from_text(texts[-1]), configuration(bag)[0]
    except BagError as error:
        raise SourceError(str(error)) from error
    except ValueError as error:
        raise SourceError(f"{path}: {error}") from error
    axes = tuple(config.actuated)
    if told.refusal:
        raise SensorCheckError(told.refusal, told.findings, axes)
    heard, used = {**listen(bag, config), **_asked(bag, config)}, channels_used(config, told.ignored)
    missing = [axis for axis in axes if axis not in heard or EXCITATION + axis not in heard]
    if missing:
        raise SourceError(f"{path}: no torque or excitation of {', '.join(missing)}")
    driven = [_driven(heard, config, told, start_ns * NS) for start_ns in told.starts_ns]
    records = tuple(record_of(config, run, told.plan, used) for run in driven)
    return MeasuredTest(axes, told.plan, told.findings, records)


def _asked(bag: Bag, config: ManipulatorConfig) -> Heard:
    """Return torques of commands, and what in them excites, of every axis by ``COMMANDS`` or ``EXCITATION``.

    A message bears the stamp of its state; it is made for the period after it.
    """
    found: dict[str, tuple[list[float], list[list[float]]]] = {EXCITATION: ([], []), COMMANDS: ([], [])}
    for record in bag.records:
        if record.name in found:
            msg = decode(record)
            names = msg.name if record.name == EXCITATION else msg.names
            by_name = dict(zip(names, msg.effort, strict=False))
            times, values = found[record.name]
            times.append(stamp_to_ns(msg.header.stamp) * NS + 1.0 / config.rate_hz)
            values.append([by_name.get(axis, np.nan) for axis in config.actuated])
    heard: dict[str, tuple[Array, Array]] = {}
    for topic, (times, values) in found.items():
        if times:
            t, y = np.array(times), np.array(values)
            order = np.argsort(t)
            heard |= {topic + axis: (t[order], y[order, k]) for k, axis in enumerate(config.actuated)}
    return heard


def _driven(heard: Heard, config: ManipulatorConfig, told: ToldTest, start: float) -> Driven:
    """Return a run, its samples by straight lines between their stamps, torques as they were held."""
    n = len(told.plan.added(0))
    t = np.asarray(start + np.arange(n) / told.plan.excitation.rate_hz)
    axes = tuple(config.actuated)
    y = [_sampled(heard, channel, t) for channel in channels(config)]
    tau = np.column_stack([held(t, *heard[axis]) for axis in axes])
    added = np.column_stack([held(t, *heard[EXCITATION + axis]) for axis in axes])
    if all(COMMANDS + axis in heard for axis in axes):
        commanded = np.column_stack([held(t, *heard[COMMANDS + axis]) for axis in axes])
        added = acted_excitation(tau, commanded, added)
    return Driven(tau, added, np.column_stack(y))


def _sampled(heard: Heard, channel: Channel, t: Array) -> Array:
    """Return a channel at instants, nan where it was silent for long, (n,)."""
    if channel.name not in heard:
        return np.full(t.size, np.nan)
    times, values = heard[channel.name]
    after = np.clip(np.searchsorted(times, t), 1, times.size - 1)
    near = np.minimum(abs(t - times[after - 1]), abs(times[after] - t))
    return np.where(near <= LONGEST_GAP / 2, np.interp(t, times, values), np.nan)
