"""The drift watch on a bag: every sensor message goes to the watch in the order of the bag.

A fault of a sensor reads as a change of the arm. Where the bag holds no word of an estimator on its sensors,
one with the settings of the bag hears them beside the watch.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from flexarm_bringup.bags.bag_reader import Bag, Record, decode
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.consistency.recording import NoController
from flexarm_bringup.drift_run.simulation import EVERY, Watched
from flexarm_bringup.replaying.player import Player
from flexarm_bringup.replaying.replay_bag import configuration
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_bringup.tick_check import TICK
from flexarm_bringup.topics import NAMESPACE
from flexarm_estimator.drift.drift_watch import DriftWatch
from flexarm_estimator.drift.exchange import STATE_TOPIC, STATES, DriftExchange
from flexarm_estimator.drift.judgement import ModeNow
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.exchange import INTERVENTIONS_TOPIC, EstimatorExchange
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import NS_PER_S, stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.settings.strict_yaml import ConfigError

TIME = "joint_states"
STATES_NAME = f"{NAMESPACE}/{STATE_TOPIC}"
JUDGED_ANEW = f"the bag holds no {STATE_TOPIC}: an estimator beside the watch judged the sensors"
UNJUDGED = f"the bag holds no {STATE_TOPIC}: no fault of a sensor is known; one reads as a change of the arm"
LONG_ENOUGH = 2.0  # s; the watch settles for one, and looks


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
    topics = ("model", INTERVENTIONS_TOPIC, STATE_TOPIC, *DriftExchange(config, estimator).topics)
    wanted = {f"{NAMESPACE}/{topic}" for topic in topics}
    judge = None if bag.counts.get(STATES_NAME) else _Judge(bag, config, estimator)
    records = _messages((record for record in bag.records if record.name in wanted), judge)
    try:
        watched = watch_messages(records, config, estimator, watched_by)
    except ValueError as error:
        raise BagError(f"{bag.path}: {error}") from error
    return watched if judge is None else replace(watched, judged=judge.remark)


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
    notes, start_ns, now = _Notes(), None, 0.0
    for name, msg in messages:
        topic = name.removeprefix(f"{NAMESPACE}/")
        _hand_over(exchange, topic, msg)
        if topic != TIME or exchange.watch is None:
            continue
        stamp_ns = stamp_to_ns(msg.header.stamp)
        start_ns = stamp_ns if start_ns is None else start_ns
        now = (stamp_ns - start_ns) * 1e-9
        notes.note(now, exchange.watch, exchange.said_of_sensors)
    if exchange.watch is None:
        raise ValueError(exchange.fault)
    if not notes.t:
        raise ValueError(_nothing_watched(start_ns, now, exchange.said_of_sensors))
    return notes.watched(exchange.watch)


class _Judge:
    """An estimator that hears a bag.

    Attributes:
        remark: Who judged the sensors.
    """

    def __init__(self, bag: Bag, config: ManipulatorConfig, settings: EstimatorConfig) -> None:
        lockstep = bag.counts.get(TICK, 0) > 0
        player = Player(
            EstimatorExchange(config, settings, 0 if lockstep else None), NoController(), lockstep
        )
        self._states = ((r, out.msg) for r, out in player.play(bag.records) if out.topic == STATE_TOPIC)
        self._next = next(self._states, None)
        self.remark = UNJUDGED if self._next is None else JUDGED_ANEW

    def until(self, log_time_ns: int) -> Iterator[Any]:
        """Yield what it told before a time of the bag [ns]."""
        while self._next is not None and self._next[0].log_time_ns < log_time_ns:
            yield self._next[1]
            self._next = next(self._states, None)


def _messages(records: Iterable[Record], judge: _Judge | None) -> Iterator[tuple[str, Any]]:
    """Yield topic and message, of the states of the estimator only as many as the live watch reads."""
    next_ns = 0
    for record in records:
        is_due = record.log_time_ns >= next_ns
        for state in judge.until(record.log_time_ns) if judge is not None else ():
            if is_due:
                is_due, next_ns = False, record.log_time_ns + round(STATES * NS_PER_S)
                yield STATES_NAME, state
        if record.name == STATES_NAME:
            if not is_due:
                continue
            next_ns = record.log_time_ns + round(STATES * NS_PER_S)
        yield record.name, decode(record)


def _hand_over(exchange: DriftExchange, topic: str, msg: Any) -> None:
    if topic == "model":
        exchange.on_model(msg)
    elif topic == STATE_TOPIC:
        exchange.on_state(msg)
    elif topic == INTERVENTIONS_TOPIC:
        exchange.on_intervention(msg)
    elif topic in exchange.topics:
        exchange.on_sensor(topic, msg)


class _Notes:
    """What the watch has said, row by row."""

    def __init__(self) -> None:
        self.t: list[float] = []
        self._modes: list[tuple[ModeNow, ...]] = []
        self._alarms: list[tuple[float, str]] = []
        self._sensors: list[tuple[float, str]] = []
        self._told: set[str] = set()

    def note(self, now: float, watch: DriftWatch, said: str) -> None:
        """Take what is new at a time [s]; ``said`` of the sensors."""
        self._alarms += [(now, text) for mode, text in watch.alarms.items() if mode not in self._told]
        self._told = set(watch.alarms)
        if said != (self._sensors[-1][1] if self._sensors else ""):
            self._sensors.append((now, said))
        if watch.modes and (not self.t or now - self.t[-1] >= EVERY):
            self.t.append(now)
            self._modes.append(watch.modes)

    def watched(self, watch: DriftWatch) -> Watched:
        """Return it all, as it is at the end."""
        rows, alarms, sensors = tuple(self._modes), tuple(self._alarms), tuple(self._sensors)
        return Watched(np.array(self.t), rows, alarms, "", watch.proposal, sensors=sensors)


def _nothing_watched(start_ns: int | None, seconds: float, said: str) -> str:
    if start_ns is None:
        return f"no {TIME} after its model: there is nothing to watch"
    if said:
        return f"no mode is running after {seconds:.2f} s of {TIME}: the watch {said}"
    if seconds > LONG_ENOUGH:
        return f"{seconds:.2f} s of {TIME} after its model: in no period torque and sensors were all told"
    return f"{seconds:.2f} s of {TIME} after its model are too short: no mode is running yet"
