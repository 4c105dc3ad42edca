"""What seed 003 compares: one robot as seven models, their responses, and how far those lie apart."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.reference import read_records
from flexarm_bringup.share import share_path
from flexarm_model.bodies.model_order import FULL, with_modes_below, with_rigid_beams
from flexarm_model.manipulator.description import Axis, Joint, ManipulatorConfig
from flexarm_model.modal.frf import Frf, Ports, exact_frf
from flexarm_model.reading.config import load_config
from flexarm_model.served.linear_assembly import LinearAssembly, assemble

Array = NDArray[np.float64]

POSES = ("home", "mid", "stretched")
FLANGE = "disc.end"
LOW_HZ, HIGH_HZ = 4.0, 100.0  # of the paper's responses; below 4 Hz the six rigid modes rule
_BANDS = ((LOW_HZ, HIGH_HZ, 1.0), (HIGH_HZ, 300.0, 4.0), (300.0, 1000.0, 10.0))  # from, to, step [Hz]
DESCRIPTIONS = {
    "full": "finite elements, 8 per long link",
    "guyan": "interface nodes alone (S-node)",
    "cb_500": "and fixed-interface modes to 500 Hz",
    "cb_1000": "and fixed-interface modes to 1000 Hz",
    "six_axis": "rigid links, six-axis joints",
    "lumped": "rigid links, three springs per joint",
    "rigid": "rigid links, gear springs alone",
}


class Linear(Protocol):
    """A linear model, as assembled or as served."""

    @property
    def M(self) -> Array:
        """Mass, (n, n)."""

    @property
    def D(self) -> Array:
        """Damping, (n, n)."""

    @property
    def K(self) -> Array:
        """Stiffness, (n, n)."""

    @property
    def B(self) -> Array:
        """Input, (n, 6)."""


@dataclass(frozen=True)
class Deviation:
    """Mean of ``|20 log10(|H| / |H_ref|)|`` over lines and entries [dB].

    Attributes:
        mean: Over all 36 entries.
        diagonal, off_diagonal: Over the entries on and off the diagonal.
    """

    mean: float
    diagonal: float
    off_diagonal: float


@cache
def robot(preset: str = "") -> ManipulatorConfig:
    """Return the description of the robot."""
    return load_config(share_path("config/manipulators/serial_6r.yaml"), preset)


@cache
def models() -> dict[str, ManipulatorConfig]:
    """Return the robot in every order of ``DESCRIPTIONS``."""
    rigid_links = with_rigid_beams(robot())
    return {
        "full": with_modes_below(robot(), FULL),
        **{name: robot(name) for name in ("guyan", "cb_500", "cb_1000")},
        "six_axis": rigid_links,
        "lumped": with_axes(rigid_links, lambda joint, axis: axis.name[0] == "r"),
        "rigid": with_axes(rigid_links, is_gear),
    }


def pose_of(name: str) -> Array:
    """Return the motors' angles at a pose [rad], (6,)."""
    return robot().poses.get(name, robot().home)


def at_pose(config: ManipulatorConfig, pose: str) -> LinearAssembly:
    """Return the linear model of a robot at a pose."""
    return assemble(config, dict(zip(config.actuated, pose_of(pose).tolist(), strict=True)))


@cache
def model_at(name: str, pose: str) -> LinearAssembly:
    """Return one of the models at a pose."""
    return at_pose(models()[name], pose)


def is_gear(joint: Joint, axis: Axis) -> bool:
    """Return whether the spring of a bushing is the gear: it acts about the axis of its motor."""
    motor = next(j for j in robot().joints if j.child == joint.parent and j.axes)
    return axis.name == motor.axes[0].name


def with_axes(config: ManipulatorConfig, kept: Callable[[Joint, Axis], bool]) -> ManipulatorConfig:
    """Return the robot with the springs that are kept; the other axes of its bushings do not move."""
    return _with_joints(config, lambda j: tuple(a for a in j.axes if a.actuated or kept(j, a)))


def with_springs(config: ManipulatorConfig, changed: Callable[[Joint, Axis], Axis]) -> ManipulatorConfig:
    """Return the robot with changed springs."""
    return _with_joints(config, lambda j: tuple(a if a.actuated else changed(j, a) for a in j.axes))


def motor_frf(model: Linear, f_hz: Array) -> Frf:
    """Return motor acceleration per motor torque, output side [(rad/s^2)/(N m)], (k, 6, 6)."""
    return exact_frf(f_hz, (model.M, model.D, model.K), Ports(model.B, model.B.T), "accelerance")


def lines_hz(high: float = HIGH_HZ) -> Array:
    """Return the lines from 4 Hz to ``high`` [Hz], equidistant in each band; the paper is silent on them."""
    bands = [np.arange(low, top, step) for low, top, step in _BANDS]
    lines = np.concatenate([*bands, [_BANDS[-1][1]]])
    return lines[lines <= high]


@cache
def responses(name: str, pose: str, high: float = HIGH_HZ) -> Frf:
    """Return the responses of one of the models up to ``high`` [Hz]."""
    return motor_frf(model_at(name, pose), lines_hz(high))


def deviation(frf: Frf, reference: Frf, low: float = 0.0, high: float = np.inf) -> Deviation:
    """Return how far two matrices of responses lie apart in a band [Hz]."""
    off = abs(frf.band(low, high).db() - reference.band(low, high).db())  # (k, 6, 6)
    on_diagonal = np.eye(off.shape[1], dtype=bool)
    return Deviation(float(off.mean()), float(off[:, on_diagonal].mean()), float(off[:, ~on_diagonal].mean()))


def published() -> dict[str, float]:
    """Return every number that the text prints about results, by its name."""
    return {name: float(cells["value"]) for name, cells in read_records("seed003_results").items()}


def _with_joints(config: ManipulatorConfig, axes: Callable[[Joint], tuple[Axis, ...]]) -> ManipulatorConfig:
    return replace(config, joints=tuple(replace(j, axes=axes(j)) for j in config.joints))
