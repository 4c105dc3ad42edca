"""Names of joints and bodies are apart: an axis "base.rz" and a node "base.rz" may both be there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm

from flexarm_model.manipulator.body_spec import RigidBody
from flexarm_model.manipulator.description import Joint, ManipulatorConfig, NodeRef
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree


def with_cup(body: str, node: str) -> ManipulatorConfig:
    """Return the single link with a body at its tip and an accelerometer at a node of it."""
    config = arm("single_link")
    nodes = {"root": np.zeros(3), node: np.array([0.1, 0.0, 0.0])}
    cup = RigidBody(body, 0.1, np.zeros(3), np.eye(3) * 1e-4, nodes)
    joint = Joint("weld", NodeRef("strip", "tip"), NodeRef(body, "root"), np.eye(4), ())
    felt = SensorSpec("felt", "accelerometer", f"{body}.{node}", ("x", "y"), np.full(2, 0.1))
    bodies = {**config.bodies, body: cup}
    return replace(
        config, bodies=bodies, joints=(*config.joints, joint), sensors=(*config.sensors, felt), tip=config.tip
    )


def test_a_node_may_be_named_as_an_axis_is() -> None:
    assert "base.rz" in arm("single_link").axes
    outputs = [
        linearize(ReducedTree(with_cup(*names), use_compiler=False)).outputs
        for names in (("base", "rz"), ("cup", "far"))
    ]
    assert outputs[0].names == outputs[1].names
    for part in ("y0", "C_pos", "C_vel", "C_acc"):
        assert getattr(outputs[0], part) == pytest.approx(getattr(outputs[1], part), abs=1e-12)
