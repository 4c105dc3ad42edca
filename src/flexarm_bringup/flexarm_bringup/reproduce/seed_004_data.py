"""What seed 004 is compared with: the photographed poses, the filmed moves, and the arm's three lengths.

Angles are in degrees and positions in millimetres, as the paper prints them; q = (base, shoulder, elbow).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.reference import read_records
from flexarm_bringup.share import share_path
from flexarm_model.kinematics.elbow_arm import ElbowArm
from flexarm_model.manipulator.body_spec import RigidBody
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

MANIPULATOR = "config/manipulators/variable_stiffness.yaml"
ALONG = "xyz"
FRONT_AZIMUTH_DEG = 90.0  # the front camera sees the plane of the arm
COPIED_SAMPLE = "19"  # of table 4: a copy of sample 11 at a later time
OFF_CIRCLE_SAMPLE, ON_CIRCLE_MM = "26", 481.98  # of table 4: theory x is printed 491.11
END_DEG = (-43.0, 15.90, -44.975)  # where the printed theory of table 4 settles
START_DEG = (0.0, 90.0, 0.0)
JOINT_OF_PHASE = {"A": 1, "B": 2, "C": 0}


def arm_config(preset: str = "") -> ManipulatorConfig:
    """Return the description of the arm."""
    return load_config(share_path(MANIPULATOR), preset)


def elbow_arm(config: ManipulatorConfig) -> ElbowArm:
    """Return the geometry: every link's length is how far its joint's node lies behind its root."""
    nodes = (("link_1", "base", 1), ("link_2", "shoulder", 0), ("link_3", "elbow", 0))
    lengths = []
    for name, node, along in nodes:
        body = config.bodies[name]
        assert isinstance(body, RigidBody)  # what the file says; narrows the type
        lengths.append(-float(body.nodes[node][along]))
    return ElbowArm(*lengths)


def place_tips(arm: ElbowArm, q_deg: Array) -> Array:
    """Return the tip [mm] at every pose q [deg], each (k, 3)."""
    return 1e3 * np.array([arm.position(q) for q in np.radians(q_deg)])


@dataclass(frozen=True)
class Photographs:
    """Table 3: static poses, each seen by one of two cameras; NaN where a camera sees nothing.

    Attributes:
        names: Number of the pose, (k,).
        front: Seen from the front (y and z) instead of from above (x and y), (k,).
        printed_deg: Angles as printed, (k, 3).
        restored_deg: The same with the lost minus of the elbow, and the azimuth that the camera sees, (k, 3).
        measured, theory: Tip [mm], (k, 3).
    """

    names: tuple[str, ...]
    front: Mask
    printed_deg: Array
    restored_deg: Array
    measured: Array
    theory: Array

    @property
    def signed_deg(self) -> Array:
        """Angles with the lost minus of the elbow, azimuth as printed, (k, 3)."""
        return np.column_stack([self.printed_deg[:, 0], self.restored_deg[:, 1:]])

    @property
    def theory_deg(self) -> Array:
        """Angles that the printed theory was made with, (k, 3): the upper rows lie flat, but for the last."""
        flat = ~self.front[:, None] & np.array([False, True, True])
        angles = np.where(flat, 0.0, self.restored_deg)
        angles[-1, 0] = self.printed_deg[-1, 0]
        return angles


@dataclass(frozen=True)
class Film:
    """Table 4: samples of three moves, one joint after the other, without the copied one.

    Attributes:
        names: Number of the sample, (k,).
        joint: Which joint moves, 0 to 2, (k,).
        t: Time of the nearest frame [s], (k,).
        measured, theory: Tip [mm], (k, 3); what the camera does not see is printed 0 or 2.81.
        seen: Whether the camera sees this axis, (k, 3).
    """

    names: tuple[str, ...]
    joint: NDArray[np.int64]
    t: Array
    measured: Array
    theory: Array
    seen: Mask


def read_photographs() -> Photographs:
    """Return table 3."""
    table = read_records("seed004_table3")
    front = np.array([row["view"] == "front_XZ" for row in table.values()])
    printed = _columns(table, ["theta1_deg", "theta2_deg", "theta3_printed_deg"])
    restored = _columns(table, ["theta1_deg", "theta2_deg", "theta3_restored_deg"])
    restored[front, 0] = FRONT_AZIMUTH_DEG
    measured, theory = (_columns(table, [f"{key}_{axis}_mm" for axis in ALONG]) for key in ("exp", "th"))
    return Photographs(tuple(table), front, printed, restored, measured, theory)


def read_film(as_printed: bool = False) -> Film:
    """Return table 4 without its copied sample.

    Args:
        as_printed: Leave the misprinted x of the last sample as it is; otherwise it is put on its circle.
    """
    table = {name: row for name, row in read_records("seed004_table4").items() if name != COPIED_SAMPLE}
    if not as_printed:
        table[OFF_CIRCLE_SAMPLE]["th_x_mm"] = str(ON_CIRCLE_MM)
    joint = np.array([JOINT_OF_PHASE[row["phase"]] for row in table.values()])
    measured, theory = (_columns(table, [f"{key}_{axis}_mm" for axis in ALONG]) for key in ("exp", "th"))
    seen = np.column_stack([np.full(len(joint), True), joint == 0, joint != 0])
    return Film(tuple(table), joint, _columns(table, ["t_frame_s"])[:, 0], measured, theory, seen)


def find_moving_angle(film: Film, arm: ElbowArm, tip: Array) -> Array:
    """Return the angle [deg] of the joint that moves, (k,), from a tip [mm], (k, 3); the others stand.

    Args:
        film: Says which joint moves.
        arm: The geometry.
        tip: As printed, measured or theory.
    """
    x, y, z = tip.T / 1e3
    raised = np.radians(END_DEG[1])
    elbow = arm.upper * np.array([np.cos(raised), np.sin(raised)])  # of the arm as the shoulder leaves it
    z = z - arm.height
    angles = [np.arctan2(y, x), np.arctan2(z, x), np.arctan2(z - elbow[1], x - elbow[0]) - raised]
    return np.asarray(np.degrees(np.choose(film.joint, angles)))


def mean_errors(predicted: Array, measured: Array) -> Array:
    """Return the mean absolute error along every axis that was seen (not NaN), (3,)."""
    return np.asarray(np.nanmean(np.abs(predicted - measured), axis=0))


def _columns(table: dict[str, dict[str, str]], names: Sequence[str]) -> Array:
    """Return columns side by side, (k, len(names)); an empty cell is NaN."""
    return np.array([[float(row[name] or "nan") for name in names] for row in table.values()])
