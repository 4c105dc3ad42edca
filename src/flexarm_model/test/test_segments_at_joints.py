"""Segments are cut where something bears a moment, so that a joint anywhere leaves them of second order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, arm, bar

from flexarm_model.manipulator.body_spec import PointMass, Reduction, RigidBody
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.segments.segments import Segment, cut_beam
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

OFF_GRID = 0.37 * BAR.length
ROD = RigidBody("rod", 0.5, np.array([0.2, 0.0, 0.0]), 1e-3 * np.eye(3), {"root": np.zeros(3)})
BALL = PointMass("ball", OFF_GRID, 0.5, 0.02)
WELD = Joint("weld", NodeRef("bar", "middle"), NodeRef("rod", "root"), np.eye(4), ())


def loaded(*, by_rod: bool) -> ManipulatorConfig:
    """Return a bar on a motor with a rod welded to it between its ends, or with a ball that turns there.

    The ball stands where two of 100 elements meet.
    """
    beam = bar(
        ["bend_y"], elements=100, nodes={"root": 0.0, "middle": OFF_GRID, "end": BAR.length},
        point_masses=() if by_rod else (BALL,), reduction=Reduction("craig_bampton", 16, "clamped"),
    )  # fmt: skip
    motor = (Axis("rz", actuated=True, rotor_inertia=1.0),)
    base = Joint("base", NodeRef(WORLD, "root"), NodeRef("bar", "root"), np.eye(4), motor)
    return replace(
        arm("planar"), bodies={"bar": beam} | ({"rod": ROD} if by_rod else {}), sensors=(), modes=3,
        joints=(base, WELD) if by_rod else (base,), tip=NodeRef("bar", "end"),
        gravity=np.zeros(3), home=np.zeros(1),
    )  # fmt: skip


@pytest.mark.parametrize("by_rod", [True, False])
def test_frequencies_are_of_second_order_wherever_a_moment_is_borne(by_rod: bool) -> None:
    """Riding on whatever segment covered it, a rod left errors of 0.3, 1.6 and 1.8 % at 64 segments."""
    config, counts = loaded(by_rod=by_rod), np.array([8, 16, 32])
    exact = linearize(ReducedTree(config, use_compiler=False)).omega
    trees = [SegmentTree(config, int(n)) for n in counts]
    error = np.array([abs(t.locked_frequencies(t.close(config.home), 3) / exact - 1) for t in trees])
    print("\nfrequency errors of 8, 16, 32 segments [%]:\n", 100 * error)
    order = -np.polyfit(np.log(counts), np.log(error), 1)[0]
    assert order == pytest.approx([2.0, 2.0, 2.0], abs=0.25)
    assert error[-1].max() < 4e-3


def described(segments: list[Segment]) -> list[tuple[float, ...]]:
    """Return where the segments' springs stand, how stiff they are and how heavy the segments."""
    return [(s.spring_at, s.length, s.to_next, s.mass, *(k for _, _, k in s.springs)) for s in segments]


def test_a_joint_between_two_segments_changes_none_of_them() -> None:
    beam = bar(["bend_y"])
    for cuts in ([0.25 * BAR.length], [0.0, 0.125 * BAR.length, 0.5 * BAR.length, BAR.length]):
        for at, expected in zip(
            described(cut_beam(beam, 8, cuts)), described(cut_beam(beam, 8)), strict=True
        ):
            assert at == pytest.approx(expected, rel=1e-12)


def test_a_joint_stands_between_two_half_segments_none_longer_than_asked_for() -> None:
    segments = cut_beam(replace(bar(["bend_y"]), nodes={"root": 0.0, "middle": OFF_GRID}), 5, [OFF_GRID])
    (carrier,) = [s for s in segments if "middle" in s.nodes]
    before, after = carrier.length, segments[carrier.index + 1].length
    assert carrier.spring_at + before / 2 == pytest.approx(OFF_GRID, rel=1e-12)
    assert segments[carrier.index + 1].spring_at - after / 2 == pytest.approx(OFF_GRID, rel=1e-12)
    assert sum(s.length for s in segments[1:]) == pytest.approx(BAR.length, rel=1e-12)
    assert max(s.length for s in segments) <= BAR.length / 5
    assert sum(s.mass for s in segments) == pytest.approx(BAR.density * BAR.area * BAR.length, rel=1e-12)


def test_a_joint_next_to_an_end_or_to_another_counts_as_there() -> None:
    beam, near = bar(["bend_y"]), 1e-5 * BAR.length
    cuts = [near, BAR.length - near]
    assert described(cut_beam(beam, 4, cuts)) == described(cut_beam(beam, 4))
    assert len(cut_beam(beam, 4, [OFF_GRID, OFF_GRID + near])) == len(cut_beam(beam, 4, [OFF_GRID]))
