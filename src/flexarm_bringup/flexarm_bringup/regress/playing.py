"""What today's code makes of a recorded bag: the estimator's and controller's messages, and the models anew.

The nodes play with the models that were recorded. Beside them every recorded model is computed again about
its pose: a wrong sign in a Jacobian then shows where it is made, not only in what follows from it.
"""

from __future__ import annotations

import errno
import json
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flexarm_bringup.bags.bag_reader import Bag, Record
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.configuration import recorded_settings
from flexarm_bringup.conversions import deserialise, serialise
from flexarm_bringup.provenance import git_hash
from flexarm_bringup.regress.case import Case
from flexarm_bringup.regress.case_settings import lay_over
from flexarm_bringup.regress.named_arm import arm_of
from flexarm_bringup.replaying.replay_bag import OUTPUTS, configuration, replay
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.conversions import model_to_msg, stamp_to_ns
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.served.linearize import linearize
from flexarm_model.served.parameters_of_model import parameters_of
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.settings.units import RAD_PER_HZ
from flexarm_model.tree.reduced_tree import ReducedTree

MODEL = f"{NAMESPACE}/model"
# whatever code with a fault raises or ends with says nothing against the other cases: no list holds it all
FAULTS = (Exception, SystemExit)
# what is played is kept in a scratch folder: of these the machine is at fault, not the code
_MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EMFILE, errno.ENFILE)


def configured(bag: Bag, case: Case) -> Bag:
    """Return the bag with the manipulator that the case says instead of its own, and settings over its own.

    Raises:
        BagError: Its settings are not values by node.
        ConfigError: There is no such manipulator, or no such setting to take away.
    """
    said: dict[str, str] = {}
    described_by = bag.described_by
    if case.manipulator:
        path = described_by = arm_of(case)
        said |= {"manipulator": path.stem, "description": path.read_text(encoding="utf8")}
        said |= {"preset": case.preset, "settings": bag.custom.get("settings", "{}")}
    if case.settings:
        recorded = recorded_settings(bag) if "settings" in bag.custom else {}
        said["settings"] = json.dumps(lay_over(recorded, case))
    return replace(bag, custom={**bag.custom, **said}, described_by=described_by)


@dataclass(frozen=True)
class Played:
    """What came of a bag.

    Attributes:
        bag: All messages by log time, models first; in memory only.
        faults: What was raised, by the topic that nothing came of then.
    """

    bag: Bag
    faults: Mapping[str, str]


def play(bag: Bag) -> Played:
    """Play a bag and compute its models anew; whatever that raises is a fault of today's code.

    Args:
        bag: What was recorded, with its configuration, both proved.

    Raises:
        ConfigError, ParameterError: The settings are not understood.
        BagError, OSError: The machine has no room for what is played.
    """
    faults: dict[str, str] = {}
    records: list[Record] = []
    for topic, attempt in ((MODEL, models), (OUTPUTS[0], _messages)):
        try:
            records += attempt(bag)
        except (ConfigError, ParameterError):
            raise  # what is asked for is not understood
        except FAULTS as error:
            if _is_of_machine(error):
                raise
            text = " ".join(str(error).split()).removeprefix(f"{bag.path}: gives no {topic}: ")
            faults[topic] = text if isinstance(error, BagError) else f"{type(error).__name__}: {text}"
    records.sort(key=lambda record: record.log_time_ns)
    counts = {**Counter(record.name for record in records)}
    return Played(Bag(bag.path, tuple(records), counts, {**bag.custom, "git": git_hash()}), faults)


def models(bag: Bag) -> Iterator[Record]:
    """Yield every model of a bag, computed again about its pose, for the parameters it was made for.

    Raises:
        PoseError, ClosureError: There is none any more.
    """
    config, settings = configuration(bag)
    tree = ReducedTree(starting_at(config, settings.get("model", {}).get("start", ())))
    values = dict(config.parameters)
    for record in bag.records:
        if record.name == MODEL:
            msg = deserialise(record.cdr, record.type)
            values = parameters_of(tree, np.array(msg.pose), RAD_PER_HZ * np.array(msg.f_hz), values)
            model = linearize(tree.under(values), np.array(msg.pose))
            again = model_to_msg(model, stamp_to_ns(msg.header.stamp), msg.header.frame_id)
            yield replace(record, cdr=serialise(again, record.type))


def _is_of_machine(error: BaseException) -> bool:
    return any(
        isinstance(each, OSError) and each.errno in _MACHINE for each in (error, error.__cause__)
    )  # a replay tells it as a BagError


def _messages(bag: Bag) -> Sequence[Record]:
    with tempfile.TemporaryDirectory() as scratch:
        return replay(bag, Path(scratch) / "played").records
