"""One arm by a standard and by a modified table of Denavit and Hartenberg: the same place of its flange."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from descriptions import refusal, write_arm
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from flexarm_model.kinematics.dh import DhChain, DhRow, ModifiedDhRow
from flexarm_model.kinematics.spherical_wrist import SphericalWristArm
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SIX = SphericalWristArm(d1=0.50, a1=0.18, a2=0.80, a3=0.15, d4=0.85, d6=0.14).chain
MASS = {"type": "rigid", "mass": "1 kg", "inertia": [*["0.1 kg m^2"] * 3, *["0 kg m^2"] * 3]}


def modified(chain: DhChain) -> tuple[DhChain, DhRow]:
    """Return the modified table of the same axes, and the step that is left to the flange."""
    before = [DhRow(0.0, 0.0, 0.0), *chain.rows]
    rows = tuple(
        ModifiedDhRow(row.d, link.a, link.alpha, row.offset)
        for link, row in zip(before, chain.rows, strict=False)
    )
    return DhChain(rows), DhRow(0.0, before[-1].a, before[-1].alpha)


def step(row: DhRow | ModifiedDhRow) -> dict[str, Any]:
    """Return a line of a table as a description has it."""
    convention = {DhRow: "standard", ModifiedDhRow: "modified"}[type(row)]
    lengths = {key: f"{getattr(row, key)!r} m" for key in ("d", "a")}
    angles = {key: f"{getattr(row, key)!r} rad" for key in ("alpha", "offset")}
    return {"convention": convention, **lengths, **angles}


def written(steps: list[dict[str, Any] | None]) -> dict[str, Any]:
    """Return a description whose joints, and the weld of the flange at the end, have these steps."""
    n = len(steps) - 1
    bodies = {f"link_{i + 1}": MASS for i in range(n)} | {"flange": {"type": "rigid", "mass": "1 kg"}}
    roots = ["world", *(f"{name}.root" for name in bodies)]
    joints: dict[str, Any] = {}
    for i, dh in enumerate(steps):
        axes = {"rz": {"actuated": True}} if i < n else {}
        joint = {"parent": roots[i], "child": roots[i + 1], "axes": axes}
        joints[f"joint_{i + 1}"] = {**joint, **({"dh": dh} if dh else {})}
    return {
        "format": "flexarm/1", "name": "table", "source": "made up", "gravity": ["0 m/s^2"] * 3,
        "bodies": bodies, "joints": joints, "tip": "flange.root",
        "served": {"modes": 0, "home": ["0 deg"] * n, "rate": "200 Hz"},
    }  # fmt: skip


def conventions(chain: DhChain) -> dict[str, list[dict[str, Any] | None]]:
    other, flange = modified(chain)
    return {
        "standard": [None, *map(step, chain.rows)],
        "modified": [*map(step, other.rows), step(flange)],
    }


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_bodies_of_either_table_stand_where_the_closed_form_says(tmp_path: Path, convention: str) -> None:
    """Reduced tree and Pinocchio's model of the six-axis arm of seed 003, of whose axes no two are alike."""
    config = load_config(write_arm(tmp_path, written(conventions(SIX)[convention])))
    tree, segments = ReducedTree(config, use_compiler=False), SegmentTree(config, 1)
    for seed in range(10):
        q = np.random.default_rng(seed).uniform(-3.0, 3.0, 6)
        for model in (tree, segments):
            np.testing.assert_allclose(model.tip_pose(q), SIX.pose(q), atol=1e-12)


ANGLE, LENGTH = st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0)
ROW = st.builds(DhRow, LENGTH, LENGTH, ANGLE, ANGLE)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(ROW, min_size=1, max_size=7), st.integers(0, 2**32 - 1))
def test_the_modified_table_of_any_arm_is_the_same_arm(rows: list[DhRow], seed: int) -> None:
    chain, q = DhChain(tuple(rows)), np.random.default_rng(seed).uniform(-3.0, 3.0, len(rows))
    other, flange = modified(chain)
    np.testing.assert_allclose(other.pose(q) @ flange.step(0.0), chain.pose(q), atol=1e-12)
    np.testing.assert_allclose(other.jacobian(q)[3:], chain.jacobian(q)[3:], atol=1e-12)


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(ROW)
def test_a_line_is_the_joints_placement(tmp_path: Path, row: DhRow) -> None:
    for each in (row, ModifiedDhRow(row.d, row.a, row.alpha, row.offset)):
        config = load_config(write_arm(tmp_path, written([step(each), None])))
        np.testing.assert_allclose(config.joints[0].placement, each.step(0.0), atol=1e-15)


def test_what_is_left_out_of_a_line_is_zero(tmp_path: Path) -> None:
    config = load_config(write_arm(tmp_path, written([{"convention": "modified", "a": "2 m"}, None])))
    np.testing.assert_array_equal(config.joints[0].placement, ModifiedDhRow(0.0, 2.0, 0.0).step(0.0))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"dh": {"a": "1 m"}}, "joints.joint_1.dh.convention: is missing; it must be given"),
        ({"dh": {"convention": "craig"}}, "dh.convention: 'craig': expected one of standard, modified"),
        ({"dh": {"convention": "modified", "theta": "1 deg"}}, "dh.theta: '1 deg': unknown key; allowed"),
        ({"dh": {"convention": "modified", "alpha": "1 m"}}, "dh.alpha: '1 m': unit 'm' is not one of angle"),
        ({"dh": {"convention": "standard"}, "position": ["1 m"] * 3}, "position: ['1 m', '1 m', '1 m']: dh"),
        ({"dh": {"convention": "standard"}, "orientation": ["1 deg"] * 3}, "joint_1.orientation: "),
        ({"dh": "modified"}, "joint_1.dh: 'modified': a mapping of names to values"),
    ],
)  # fmt: skip
def test_a_wrong_line_is_refused_by_key(tmp_path: Path, keys: dict[str, Any], words: str) -> None:
    content = written([None, None])
    content["joints"]["joint_1"].update(keys)
    assert words in refusal(write_arm(tmp_path, content))
