"""The drift watch on a bag: every sensor message goes to the watch in the order of the bag."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from flexarm_bringup.bags.bag_reader import Bag, decode
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.drift_run.simulation import EVERY, Watched
from flexarm_bringup.replaying.replay_bag import configuration
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_bringup.topics import NAMESPACE
from flexarm_estimator.drift.exchange import DriftExchange
from flexarm_estimator.drift.judgement import ModeNow
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.settings.strict_yaml import ConfigError

TIME = "joint_states"


def settings_for(config: ManipulatorConfig) -> DriftConfig:
    """Return the watch's settings in the moves file of an arm; the defaults for an arm without one.

    Raises:
        ConfigError: The moves file cannot be used.
    """
    try:
        path = find_task(config.name)
    except ConfigError:  # nobody wrote one for it
        return DriftConfig()
    return load_task(path).under(config.preset).make("drift", DriftConfig)


def watch_bag(bag: Bag, watched_by: DriftConfig) -> Watched:
    """Return what the watch says of a bag.

    Args:
        bag: Whole.
        watched_by: Settings of the watch.

    Raises:
        BagError: It has no configuration, or no model that can be watched.
    """
    config, settings = configuration(bag)
    estimator = apply_overrides(EstimatorConfig, settings.get("estimator", {}))
    wanted = {f"{NAMESPACE}/{topic}" for topic in ("model", *DriftExchange(config, estimator).topics)}
    messages = ((record.name, decode(record)) for record in bag.records if record.name in wanted)
    try:
        return watch_messages(messages, config, estimator, watched_by)
    except ValueError as error:
        raise BagError(f"{bag.path}: {error}") from error


def watch_messages(
    messages: Iterable[tuple[str, Any]],
    config: ManipulatorConfig,
    estimator: EstimatorConfig,
    settings: DriftConfig | None = None,
) -> Watched:
    """Return what the watch says of messages.

    Args:
        messages: Absolute topic and message each, in the order in which they came.
        config: The manipulator.
        estimator: Settings of its filter.
        settings: Of the watch.

    Raises:
        ValueError: No model is among them that can be watched.
    """
    exchange = DriftExchange(config, estimator, settings)
    t, modes, alarms, told = list[float](), list[tuple[ModeNow, ...]](), list[tuple[float, str]](), set[str]()
    start_ns, now = None, 0.0
    for name, msg in messages:
        topic = name.removeprefix(f"{NAMESPACE}/")
        if topic == "model":
            exchange.on_model(msg)
        elif topic in exchange.topics:
            exchange.on_sensor(topic, msg)
        if topic != TIME or exchange.watch is None:
            continue
        stamp_ns = stamp_to_ns(msg.header.stamp)
        start_ns = stamp_ns if start_ns is None else start_ns
        now = (stamp_ns - start_ns) * 1e-9
        alarms += [(now, text) for mode, text in exchange.watch.alarms.items() if mode not in told]
        told = set(exchange.watch.alarms)
        if exchange.watch.modes and (not t or now - t[-1] >= EVERY):
            t.append(now)
            modes.append(exchange.watch.modes)
    if exchange.watch is None:
        raise ValueError(exchange.fault)
    if not t:
        raise ValueError(_nothing_watched(start_ns, now))
    return Watched(np.array(t), tuple(modes), tuple(alarms), "", exchange.watch.proposal)


def _nothing_watched(start_ns: int | None, seconds: float) -> str:
    if start_ns is None:
        return f"no {TIME} after its model: there is nothing to watch"
    return f"{seconds:.2f} s of {TIME} after its model are too short: no mode is running yet"
