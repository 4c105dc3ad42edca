"""Cost of serving a model: at a pose never asked for, and at one from the cache, of every manipulator.

CPU time of this thread, medians and 99th percentiles. The poses lie around home, up to half of the way to
the limits; those that cannot be reached are left out. Beside it the compiled functions that serving
evaluates; the rest is linear algebra on the tree's coordinates, whose number is the first figure.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import FOLDER, PACKAGE, find_manipulator
from flexarm_model.reading.share import share_folders
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.model_cache import ModelCache
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

REACH = 1.0  # of the axes around home [rad or m], at most
SHARE = 0.5  # of the way to a limit, at most

Array = np.ndarray[Any, np.dtype[np.float64]]


def manipulators() -> list[Path]:
    """Return the files of the manipulators that come along."""
    names = {path.stem for share in share_folders(PACKAGE) for path in (share / FOLDER).glob("*.yaml")}
    return [find_manipulator(name) for name in sorted(names)]


def poses_near_home(tree: ReducedTree, count: int) -> list[Array]:
    """Return random poses around home that have a model, (n_theta,) each."""
    config = tree.config
    axes = [tree.axes[i] for i in tree.actuated]
    home = np.array(config.home)
    room = np.array([min(h - axis.lower, axis.upper - h) for h, axis in zip(home, axes, strict=True)])
    reach = np.minimum(REACH, SHARE * room)
    rng, found = np.random.default_rng(1), []
    while len(found) < count:
        pose = home + reach * rng.uniform(-1.0, 1.0, home.size)
        try:
            linearize(tree, pose)
        except (PoseError, ClosureError):
            continue
        found.append(pose)
    return found


def cpu_times_us(actions: Iterator[Callable[[], object]]) -> Array:
    """Return the CPU time of every action [us]."""
    spent = []
    for action in actions:
        start = time.thread_time_ns()
        action()
        spent.append((time.thread_time_ns() - start) * 1e-3)
    return np.array(spent)


def measure(path: Path, repeats: int, use_compiler: bool) -> dict[str, float]:
    """Return the figures of one manipulator."""
    tree = ReducedTree(load_config(path), use_compiler=use_compiler)
    poses = poses_near_home(tree, repeats)
    name, q = tree.config.name, linearize(tree).q0
    cache = ModelCache(tree, capacity=len(poses))
    new = cpu_times_us((lambda pose=pose: cache.at(pose)) for pose in poses)  # type: ignore[misc]
    again = cpu_times_us((lambda pose=pose: cache.at(pose)) for pose in poses)  # type: ignore[misc]
    figures = {
        f"{name}_coordinates": float(tree.n_q),
        f"{name}_new_median_us": float(np.median(new)),
        f"{name}_new_p99_us": float(np.percentile(new, 99)),
        f"{name}_cached_median_us": float(np.median(again)),
    }
    for part in ("stiffness", "output_rows"):
        spent = cpu_times_us((lambda: tree.functions[part](q)) for _ in poses)  # noqa: B023
        figures[f"{name}_{part}_median_us"] = float(np.median(spent))
    return figures


def main(repeats: int = 300, use_compiler: bool = True) -> dict[str, float]:
    """Measure; returns times in microseconds by manipulator."""
    figures: dict[str, float] = {}
    for path in manipulators():
        figures |= measure(path, repeats, use_compiler)
    return figures


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:48} {value:12.1f}")
