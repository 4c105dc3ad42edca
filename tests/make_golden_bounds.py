"""Make the second golden case anew: bounds that bind, samples that are wrong, a model that changes.

    ./flexarm shell, then: python tests/make_golden_bounds.py

The arm is described with little torque and a strip that may bend little, so that both bounds of the MPC bind.
One strain is NaN, so is one torque that acted; one strain is far off; an encoder sample comes twice; a strain
and a camera frame are stamped too early; halfway a model about another pose is served. Recorded is what
`single_link` is made of; what comes of it is what the code made of it when the case was made.
"""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag
from flexarm_bringup.conversions import deserialise, serialise
from flexarm_bringup.regress.making import Source, make_case
from flexarm_bringup.regress.playing import MODEL, models
from flexarm_bringup.replaying.replay_bag import OUTPUTS
from flexarm_model.conversions import floats, ns_to_stamp, stamp_to_ns

FOLDER = Path(__file__).parent / "golden"
RECORDED, CASE = FOLDER / "single_link" / "bag", FOLDER / "bounds_and_bad_samples"
ABOUT = (
    "The first 0.7 s of single_link with bounds that bind, a NaN, late, doubled and far samples and another "
    "model halfway (tests/make_golden_bounds.py)."
)
DURATION = 0.7  # s
DESCRIBED = {"effort: 28 N m": "effort: 0.1 N m", "limit: 1000 ustrain": "limit: 5 ustrain"}
FAR, TURNED = 3e-5, 0.3  # strain, rad
LATE_NS, MODEL_NS, POSE = 32_000_000, 350_000_000, 0.1  # ns, ns, rad
Edit = Callable[[Any], None]


def _set(field: str, value: float) -> Edit:
    return lambda msg: getattr(msg, field).__setitem__(0, value)


def _too_early(msg: Any) -> None:
    msg.header.stamp = ns_to_stamp(stamp_to_ns(msg.header.stamp) - LATE_NS)


# what is done to the how manieth message of a topic
EDITS: dict[tuple[str, int], Edit] = {
    ("strain", 60): _set("strain", np.nan),
    ("strain", 75): _too_early,
    ("strain", 100): _set("strain", FAR),
    ("applied_effort", 65): _set("effort", np.nan),
    ("pose", 12): _too_early,
}
TWICE = ("joint_states", 80)


def bad_bag(recorded: Bag, folder: Path) -> Bag:
    """Write a bag anew as told above, without what estimator and controller said."""
    description = recorded.custom["description"]
    for before, after in DESCRIBED.items():
        if description.count(before) != 1:
            raise ValueError(f"the description has not one '{before}'")
        description = description.replace(before, after)
    bag = replace(recorded, custom={**recorded.custom, "description": description})
    heard = tuple(record for record in bag.records if record.name not in OUTPUTS)
    (model,) = models(replace(bag, records=heard))  # a model belongs to one description
    other = _edited(model, _about_another_pose)
    (other,) = models(replace(bag, records=(other,)))
    topics = tuple(topic for topic in bag.topics if topic.name not in OUTPUTS)
    records = [model if record.name == MODEL else record for record in heard]
    first_late = next(i for i, record in enumerate(records) if record.log_time_ns >= MODEL_NS)
    records.insert(first_late, replace(other, log_time_ns=MODEL_NS))
    return copy_bag(replace(bag, topics=topics), folder, _with_bad_samples(records))


def _about_another_pose(msg: Any) -> None:
    msg.pose = floats([POSE])
    msg.header.stamp = ns_to_stamp(MODEL_NS)


def _with_bad_samples(records: list[Record]) -> list[Record]:
    seen: Counter[str] = Counter()
    written: list[Record] = []
    for record in records:
        topic = record.name.rpartition("/")[2]
        seen[topic] += 1
        edit = EDITS.get((topic, seen[topic]))
        written.append(_edited(record, edit) if edit else record)
        if (topic, seen[topic]) == TWICE:
            written.append(_edited(record, _set("position", TURNED)))
    return written


def _edited(record: Record, edit: Edit) -> Record:
    msg = deserialise(record.cdr, record.type)
    edit(msg)
    return replace(record, cdr=serialise(msg, record.type))


def main(case: Path = CASE) -> dict[str, int]:
    """Make the case; return what its bag has by topic."""
    with tempfile.TemporaryDirectory() as scratch:
        bag = bad_bag(check_bag(RECORDED), Path(scratch) / "bad")
        made = make_case(Path(scratch) / "case", Source(bag.path, ABOUT, until=DURATION, markers=("ros",)))
        shutil.rmtree(case, ignore_errors=True)
        shutil.copytree(made.folder, case)
    return dict(made.bag.counts)


if __name__ == "__main__":
    for name, count in main().items():
        print(f"{count:6d}  {name}")
