"""What bending at rest costs the frequencies of a beam, joined at its root and at its other end."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from descriptions import write_arm
from numpy.typing import NDArray

from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.bent_bodies import NOTED, describe_bent, turns_at_rest
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
LENGTH, MODES = 0.7, 6
WEIGHT = np.array([5.0, -7.0, 3.0])  # m/s^2, across the beam both ways and along it


def piece(length: float, along_y: int, along_z: int) -> dict[str, Any]:
    section = {"shape": "rectangle", "along_y": f"{along_y} mm", "along_z": f"{along_z} mm"}
    said = {"length": f"{length} m", "section": section, "elements": 8}
    return {**said, "youngs_modulus": "70 GPa", "density": "2700 kg/m^3"}


def tapered(folder: Path, weight: Array, *, from_end: bool) -> Path:
    """Write a beam that a motor holds at its thick end, with 0.5 kg at its thin one.

    Args:
        folder: Where to.
        weight: Gravity [m/s^2], (3,).
        from_end: Whether the motor holds the node "end", so that the root moves; the arm is the same.
    """
    pieces = [piece(0.4, 6, 12), piece(0.3, 4, 9)]
    nodes = ("end", "root") if from_end else ("root", "end")
    turned = ["0 deg", "0 deg", "180 deg" if from_end else "0 deg"]  # x runs back
    beam = {
        "type": "beam",
        "pieces": pieces[::-1] if from_end else pieces,
        "deformation": ["bend_y", "bend_z", "torsion"],
        "damping_ratio": "1 %",
        "nodes": {"end": f"{LENGTH} m"},
        "reduction": {"method": "craig_bampton", "modes": 12},
    }
    inertia = [*["2e-4 kg m^2"] * 3, *["0 kg m^2"] * 3]
    load = {"type": "rigid", "mass": "0.5 kg", "com": ["30 mm", "20 mm", "10 mm"], "inertia": inertia}
    motor = {"rz": {"actuated": True, "effort": "10 N m", "rotor_inertia": "0.05 kg m^2"}}
    content = {
        "format": "flexarm/1",
        "name": "tapered",
        "source": "made up for the tests",
        "gravity": [f"{value} m/s^2" for value in weight.tolist()],
        "bodies": {"seat": {"type": "rigid", "mass": "0 kg"}, "beam": beam, "load": load},
        "joints": {
            "motor": {"parent": "world", "child": "seat.root", "axes": motor},
            "near": {"parent": "seat.root", "child": f"beam.{nodes[0]}", "orientation": turned},
            "far": {"parent": f"beam.{nodes[1]}", "child": "load.root", "orientation": turned},
        },
        "tip": "load.root",
        "served": {"modes": MODES, "home": ["0.3 rad"], "rate": "500 Hz"},
    }
    return write_arm(folder, content)


def served(path: Path) -> tuple[ReducedTree, ReducedModel]:
    """Return the dynamics of an arm and its model at home."""
    tree = ReducedTree(load_config(path), use_compiler=False)
    return tree, linearize(tree)


def of_segments(path: Path) -> Array:
    """Return the frequencies at home of rigid segments [rad/s], extrapolated from two numbers of them."""
    config, found = load_config(path), []
    for n in (16, 32):
        tree = SegmentTree(config, n)
        found.append(tree.locked_frequencies(tree.settle(config.home), MODES))
    return np.asarray((4 * found[1] - found[0]) / 3)


@pytest.mark.parametrize("share", [0.25, 1.0, 1.7, 2.4])
def test_frequencies_of_a_beam_bent_at_rest_are_off_by_the_square_of_its_turn(
    share: float, tmp_path: Path
) -> None:
    """By at most half of it where the root is held, and by more than it where the other end is."""
    truth = of_segments(tapered(tmp_path, share * WEIGHT, from_end=False))
    off, squares = [], []
    for from_end in (False, True):
        tree, model = served(tapered(tmp_path, share * WEIGHT, from_end=from_end))
        turn = turns_at_rest(tree, model.q0)["beam"]
        off.append(model.omega / truth - 1)
        squares.append(turn**2)
        others = f"up to {100 * abs(off[-1][1:]).max():.2f} % in modes 2 to {MODES}"
        held = f"turned by {turn:.3f} rad, held at its {'end' if from_end else 'root'}"
        print(f"{held}: {100 * off[-1][0]:+.2f} % in mode 1, {others}")
    by_segments = 2e-4  # what their extrapolation leaves
    assert abs(off[0]).max() < 0.5 * squares[0] + by_segments and off[0][0] < -0.3 * squares[0] + by_segments
    assert abs(off[1]).max() < 2.0 * squares[1] + by_segments and off[1][0] > 1.1 * squares[1] - by_segments


def test_a_beam_that_rests_noticeably_bent_is_named_with_its_turn(tmp_path: Path) -> None:
    for share, is_noted in ((0.7, False), (1.0, True)):
        tree, model = served(tapered(tmp_path, share * WEIGHT, from_end=False))
        said, turn = describe_bent(tree, model.q0), turns_at_rest(tree, model.q0)["beam"]
        assert (turn >= NOTED) == is_noted == bool(said)
    assert f"rests bent, a node turned against the frame of its body: beam {turn:.2f} rad; " in said[0]
