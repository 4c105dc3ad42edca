"""Seed 000: its table 2, the served models and the plane frame's frequencies that it is compared with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.reference import column, read_reference
from flexarm_bringup.reproduce.seed_000_frame import ELEMENTS, build_frame
from flexarm_bringup.reproduce.seed_000_rig import POSES, RIG
from flexarm_bringup.share import share_path
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

HOME = "centre"  # what the notes call the home pose
MODES = 9  # planar ones that the paper lists
GROUPS = {"1–3": slice(0, 3), "4–6": slice(3, 6), "7–9": slice(6, 9), "1–9": slice(0, 9)}


@dataclass(frozen=True)
class Published:
    """The paper's table 2 without the vertical tenth mode; every value (9,), by pose "A" and "B".

    Attributes:
        fe: Frequencies of its finite-element model [Hz].
        ema: Measured ones [Hz].
        error: Its printed error [%].
    """

    fe: Mapping[str, Array]
    ema: Mapping[str, Array]
    error: Mapping[str, Array]


def read_published() -> Published:
    """Return the paper's table 2."""
    table = read_reference("seed000_table2")
    columns = [column(table, name) for name in ("fe_hz", "ema_hz", "printed_error_percent")]
    fe, ema, error = (
        {pose: np.array([values[f"{pose}{mode}"] for mode in range(1, MODES + 1)]) for pose in "AB"}
        for values in columns
    )
    return Published(fe, ema, error)


def load(preset: str = "") -> ManipulatorConfig:
    """Return the description; preset "frf" has four modes per strip with both ends held."""
    return load_config(share_path("config/manipulators/planar_3rrr.yaml"), preset)


def actuated_pose(config: ManipulatorConfig, pose: str) -> Array:
    """Return the motor angles of a pose of the notes ("A", "B", "centre") [rad], (3,)."""
    return config.home if pose == HOME else config.poses[pose]


@dataclass(frozen=True)
class Served:
    """The product's own model of the arm.

    Attributes:
        tree: Its dynamics.
        models: Linear models by pose.
    """

    tree: ReducedTree
    models: Mapping[str, ReducedModel]

    @property
    def home_zeta(self) -> Array:
        """Damping ratios at home, where all are the one that the strips are described with [1], (n_eta,)."""
        return self.models[HOME].zeta

    def f_hz(self, pose: str) -> Array:
        """Return the frequencies at a pose with the motors locked [Hz], (n_eta,)."""
        return np.asarray(self.models[pose].omega / (2 * np.pi))


def serve(config: ManipulatorConfig) -> Served:
    """Return the reduced models at all poses; three points are not worth compiling for."""
    tree = ReducedTree(config, use_compiler=False)
    return Served(tree, {pose: linearize(tree, actuated_pose(config, pose)) for pose in POSES})


@cache
def frame_hz(pose: str, elements: int = ELEMENTS, count: int = MODES) -> tuple[float, ...]:
    """Return the slowest frequencies of the plane frame [Hz]."""
    return tuple(build_frame(RIG, POSES[pose], elements).frequencies(count).tolist())


def off_percent(found: Array, reference: Array) -> Array:
    """Return ``100 (found - reference) / reference`` [%], (n,)."""
    return 100.0 * (np.asarray(found) / np.asarray(reference) - 1.0)


def ema_error_percent(predicted: Array, ema: Array) -> Array:
    """Return the paper's measure ``100 |predicted - ema| / predicted`` [%], (n,)."""
    return np.asarray(100.0 * abs(predicted - ema) / predicted)
