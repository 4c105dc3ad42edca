"""Make the second golden case anew: bounds that bind, samples that are wrong, a model that changes.

    ./flexarm shell, then: python tests/make_golden_bounds.py

The arm is described with little torque and a strip that may bend little, so that both bounds of the MPC bind.
One strain is NaN, so is one torque that acted; one strain is far off; an encoder sample comes twice; a strain
and a camera frame are stamped too early; halfway a model about another pose is served. Recorded is what
`single_link` is made of; what comes of it is what the code made of it when the case was made.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from golden_edits import Edit, Which, edited, redescribed, remake, restamped, set_first, with_edits

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.regress.playing import MODEL, models
from flexarm_model.conversions import floats, ns_to_stamp

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
EDITS: dict[Which, Edit] = {
    ("strain", 60): set_first("strain", np.nan),
    ("strain", 75): restamped(-LATE_NS),
    ("strain", 100): set_first("strain", FAR),
    ("applied_effort", 65): set_first("effort", np.nan),
    ("pose", 12): restamped(-LATE_NS),
}
TWICE: dict[Which, Edit] = {("joint_states", 80): set_first("position", TURNED)}


def bad_bag(recorded: Bag, folder: Path) -> Bag:
    """Write a bag anew as told above, without what estimator and controller said."""
    bag = redescribed(recorded, DESCRIBED)
    model = next(record for record in bag.records if record.name == MODEL)
    (other,) = models(replace(bag, records=(edited(model, _about_another_pose),)))
    records = list(bag.records)
    first_late = next(i for i, record in enumerate(records) if record.log_time_ns >= MODEL_NS)
    records.insert(first_late, replace(other, log_time_ns=MODEL_NS))
    return copy_bag(bag, folder, with_edits(records, EDITS, TWICE))


def _about_another_pose(msg: Any) -> None:
    msg.pose = floats([POSE])
    msg.header.stamp = ns_to_stamp(MODEL_NS)


if __name__ == "__main__":
    remake(CASE, RECORDED, bad_bag, ABOUT, DURATION)
