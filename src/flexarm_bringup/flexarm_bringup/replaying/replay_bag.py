"""From a bag to the bag that estimator and controller make of it, with the configuration it was made with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_writer import BagError, BagWriter, refuse_inside, whole_or_nothing
from flexarm_bringup.bags.cdr import header_stamp_ns
from flexarm_bringup.bags.configuration import configuration as configuration
from flexarm_bringup.conversions import serialise
from flexarm_bringup.provenance import git_hash
from flexarm_bringup.replaying.player import Player
from flexarm_bringup.tick_check import check_ticks
from flexarm_bringup.topics import NAMESPACE, STREAMS, Stream, find_stream
from flexarm_controller.debug import Insight
from flexarm_controller.exchange import ControllerExchange
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipKinematics
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.time_budget import Clocks
from flexarm_estimator.exchange import EstimatorExchange
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.tree.reduced_tree import ReducedTree

NEEDED = (f"{NAMESPACE}/model", f"{NAMESPACE}/joint_states")  # without these there is nothing to replay
DEBUG = find_stream(f"{NAMESPACE}/controller_debug")
WRITTEN = tuple(s for s in STREAMS if s.publisher in ("estimator", "controller") and not s.is_optional)
OUTPUTS = tuple(stream.name for stream in WRITTEN)
NO_ESTIMATE = "its model was taken, but no estimate came of its measurements"
REPLAY = "replay"  # key under which a replay says that it is one
NO_TIME_LIMIT = 1.0  # s; the solver's cap in real time would make the result depend on the machine


def replay(bag: Bag, folder: Path) -> Bag:
    """Play a bag into a new one.

    Args:
        bag: What was recorded, with the configuration it was recorded with.
        folder: Bag to create.

    Returns:
        The new bag, read back.

    Raises:
        BagError: The bag lacks messages or its configuration, its model is refused, or ``folder`` exists,
            lies in the bag or cannot be written; nothing of it is there then.
        ConfigError, ParameterError: Its configuration is not understood.
    """
    refuse_inside(folder, bag.path)
    try:
        player, fault = _build_player(bag)
    except ParameterError as error:
        raise ParameterError(f"{bag.path}: its settings: {error}") from None
    with whole_or_nothing(folder):
        if not _write(bag, folder, player):
            reason = fault() or NO_ESTIMATE
            raise BagError(f"{bag.path}: gives no {OUTPUTS[0]}: {reason}")
        return check_bag(folder)


def is_replay(bag: Bag) -> bool:
    """Return whether a bag was written by ``replay``, to the end of what was recorded."""
    return bag.custom.get(REPLAY) == "true"


def _write(bag: Bag, folder: Path, player: Player) -> int:
    """Play a bag into a new one; return the number of estimates."""
    written = written_for(bag)
    by_topic = {stream.topic: stream for stream in written}
    with BagWriter(folder, written, {**bag.custom, "git": git_hash(), REPLAY: "true"}) as writer:
        for record, outgoing in player.play(bag.records):
            stream = by_topic[outgoing.topic]
            cdr = serialise(outgoing.msg, stream.type)
            writer.write(stream.name, header_stamp_ns(cdr) or record.log_time_ns, cdr)
    return writer.counts[OUTPUTS[0]]


def written_for(bag: Bag) -> tuple[Stream, ...]:
    """Return what a replay of a bag writes: what the two nodes always say, and what else it has of them."""
    debug = (DEBUG,) if DEBUG is not None and bag.counts.get(DEBUG.name) else ()
    return (*WRITTEN, *debug)


def _build_player(bag: Bag) -> tuple[Player, Callable[[], str]]:
    config, settings = configuration(bag)
    lockstep = check_ticks(bag) > 0
    epoch_ns = 0 if lockstep else None
    given = settings.get("controller", {})
    laws, motion = apply_overrides(ControllerConfig, given), apply_overrides(MotionConfig, given)
    mpc = replace(apply_overrides(MpcConfig, given), time_limit=NO_TIME_LIMIT)
    nmpc = apply_overrides(NmpcConfig, given)
    controller = ControllerExchange(config, laws, mpc, epoch_ns, Clocks(cpu=lambda: 0.0), motion, nmpc)
    tree = ReducedTree(config)
    controller.loads = ArmLoads(tree, limits_of(config))
    if len(written_for(bag)) > len(WRITTEN):
        tip = TipKinematics(tree)
        controller.teller.tell_more(
            Insight(tip.at, mpc, laws.period), lambda topic: topic == "controller_debug"
        )
    estimator = EstimatorExchange(
        config, apply_overrides(EstimatorConfig, settings.get("estimator", {})), epoch_ns
    )
    return Player(estimator, controller, lockstep), lambda: estimator.model_fault
