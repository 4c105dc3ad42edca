"""A recorded bag as the estimator hears it: once more with other settings, or with a sensor switched off."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Bag, Record, decode
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.named_arm import NamedArm, open_bag
from flexarm_bringup.consistency.instants import check_instants
from flexarm_bringup.replaying.player import Outgoing, Player
from flexarm_bringup.replaying.replay_bag import NEEDED, NO_ESTIMATE, configuration
from flexarm_bringup.tick_check import check_ticks
from flexarm_bringup.topics import NAMESPACE
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.exchange import EstimatorExchange
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.overrides import apply_overrides

Array = NDArray[np.float64]
TRUTH = f"{NAMESPACE}/truth"
LAST = "end_effector"  # what the estimator says last at every step
Tell = Callable[[int, int], None]


@dataclass(frozen=True)
class Recording:
    """A bag and the configuration it was recorded with.

    Attributes:
        bag: The bag.
        config: The manipulator.
        settings: Of the estimator.
        lockstep: It was recorded in lockstep.
    """

    bag: Bag
    config: ManipulatorConfig
    settings: EstimatorConfig
    lockstep: bool

    @property
    def epoch_ns(self) -> int | None:
        """Stamp that is time zero; None takes the first step's [ns]."""
        return 0 if self.lockstep else None

    def true_tip(self) -> dict[int, Array]:
        """Return the true positions of the tip by stamp [ns], (3,) each [m]; empty when not recorded."""
        found = {}
        for record in self.bag.records:
            if record.name == TRUTH:
                msg = decode(record)
                found[stamp_to_ns(msg.header.stamp)] = np.array(msg.tip[:3])
        return found


class Told(NamedTuple):
    """What the estimator said at a stamp [ns], and with which model."""

    stamp_ns: int
    estimate: Estimate
    model: ReducedModel


def open_recording(path: Path, arm: NamedArm | None = None) -> Recording:
    """Read a bag.

    Args:
        path: Folder of the bag.
        arm: Named for a bag that does not say its own.

    Raises:
        BagError: It cannot be used.
        ConfigError, ParameterError: Its configuration is not understood.
    """
    bag = open_bag(path, NEEDED, arm)
    config, settings = configuration(bag)
    estimator = apply_overrides(EstimatorConfig, settings.get("estimator", {}))
    check_instants(bag, estimator.history)
    return Recording(bag, config, estimator, check_ticks(bag) > 0)


def run_estimator(
    recording: Recording,
    off: Sequence[str] = (),
    settings: EstimatorConfig | None = None,
    sigmas: Mapping[str, Array] | None = None,
    tell: Tell | None = None,
) -> list[Told]:
    """Feed a bag to a new estimator and return all that it says.

    Args:
        recording: The bag.
        off: Sensors to do without.
        settings: Of the estimator; None takes those of the bag.
        sigmas: Standard deviations of sensors that are other than in the description, by name.
        tell: Is told how many seconds of how many are over.

    Raises:
        BagError: No model of the bag is taken.
    """
    config = with_sigmas(recording.config, sigmas or {})
    exchange = EstimatorExchange(config, settings or recording.settings, recording.epoch_ns, recording.config)
    player = Player(_Without(exchange, off), NoController(), recording.lockstep)
    told = []
    for outgoing in telling(player.play(recording.bag.records), recording.bag, tell):
        if outgoing.topic == LAST and exchange.estimate is not None and exchange.estimator is not None:
            stamp_ns = stamp_to_ns(outgoing.msg.header.stamp)
            told.append(Told(stamp_ns, exchange.estimate, exchange.estimator.model))
    if not told:
        raise BagError(f"{recording.bag.path}: gives no estimate: {exchange.model_fault or NO_ESTIMATE}")
    return told


def telling(played: Iterable[tuple[Record, Outgoing]], bag: Bag, tell: Tell | None) -> Iterator[Outgoing]:
    """Return what is sent while a bag is played, and tell every second of it that is over, of how many."""
    begin, end, over = bag.records[0].log_time_ns, bag.records[-1].log_time_ns, 0
    for record, outgoing in played:
        now = (record.log_time_ns - begin) // 10**9
        if tell is not None and now > over:
            over = now
            tell(over, (end - begin) // 10**9)
        yield outgoing


def with_sigmas(config: ManipulatorConfig, sigmas: Mapping[str, Array]) -> ManipulatorConfig:
    """Return a manipulator whose sensors have other standard deviations; it keeps its identity."""
    sensors = tuple(
        replace(spec, sigma=sigmas[spec.name]) if spec.name in sigmas else spec for spec in config.sensors
    )
    return replace(config, sensors=sensors)


class _Without:
    """The estimator with some sensors switched off as soon as it exists."""

    def __init__(self, exchange: EstimatorExchange, off: Sequence[str]) -> None:
        self._exchange, self._off = exchange, off
        self.on_sensor, self.step = exchange.on_sensor, exchange.step

    def on_model(self, msg: Any) -> Iterable[Outgoing]:
        """Switch the sensors off that are to be off, once there is an estimator."""
        outgoing = self._exchange.on_model(msg)
        if self._exchange.estimator is not None:
            for sensor in self._off:
                self._exchange.estimator.health.switch(sensor, True)
        return outgoing

    def on_intervention(self, msg: Any) -> None:
        """Do what a user did, but for switching those sensors on again."""
        if not (msg.is_on and msg.name in self._off):
            self._exchange.on_intervention(msg)


class NoController:
    """Takes the controller's place in a player, and says nothing."""

    def on_model(self, msg: Any) -> Iterable[Outgoing]:
        """Answer nothing."""
        return ()

    def on_reference(self, msg: Any) -> Iterable[Outgoing]:
        """Answer nothing."""
        return ()

    def on_guard_status(self, msg: Any) -> Iterable[Outgoing]:
        """Answer nothing."""
        return ()

    def on_modal_state(self, msg: Any) -> Iterable[Outgoing]:
        """Answer nothing."""
        return ()

    def work_ahead(self) -> None:
        """Do nothing."""
