"""A rigid body is what the manual's lines say of it: where it is heavy, and in which order it is inert."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from descriptions import refusal, write_arm

from flexarm_model.manipulator.body_spec import RigidBody
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

PAGE = Path(__file__).parents[3] / "docs/your_own_arm.md"


def content(body: dict[str, Any], roll: float = 0.0, pitch: float = 0.0) -> dict[str, Any]:
    """Return an arm of one body that a motor turns about its root, welded on with two angles [rad]."""
    turned = [f"{roll:.17g} rad", f"{pitch:.17g} rad", "0 rad"]
    axes = {"rz": {"actuated": True, "effort": "1 N m"}}
    return {
        "format": "flexarm/1",
        "name": "lump",
        "source": "made up for the tests",
        "gravity": ["0 m/s^2"] * 3,
        "bodies": {"seat": {"type": "rigid", "mass": "0 kg"}, "lump": body},
        "joints": {
            "turn": {"parent": "world", "child": "seat.root", "axes": axes},
            "weld": {"parent": "seat.root", "child": "lump.root", "orientation": turned},
        },
        "tip": "lump.root",
        "served": {"modes": 0, "home": ["0 deg"], "rate": "200 Hz"},
    }


def inertia(config: ManipulatorConfig) -> float:
    """Return what the motor of an arm without modes turns [kg m^2]."""
    return float(linearize(ReducedTree(config, use_compiler=False)).M[0, 0])


def test_a_tensor_in_the_order_of_the_manual_is_that_of_the_masses_it_stands_for(tmp_path: Path) -> None:
    """The turn of a cloud of masses about any axis through its root says order, signs and centre."""
    rng = np.random.default_rng(7)
    m, r = rng.uniform(0.1, 0.5, 6), rng.uniform(-0.2, 0.3, (6, 3))
    com = m @ r / m.sum()
    x, y, z = (r - com).T
    diagonal = m @ (y**2 + z**2), m @ (x**2 + z**2), m @ (x**2 + y**2)
    listed = [*diagonal, -m @ (x * y), -m @ (x * z), -m @ (y * z)]
    body = {
        "type": "rigid",
        "mass": f"{m.sum():.17g} kg",
        "com": [f"{value:.17g} m" for value in com],
        "inertia": [f"{value:.17g} kg m^2" for value in listed],
    }
    for roll, pitch in rng.uniform(-3.0, 3.0, (4, 2)):
        about = np.array([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
        turned = content(body, roll, pitch)
        exact = float(m @ (np.cross(about, r) ** 2).sum(axis=1))
        assert inertia(load_config(write_arm(tmp_path, turned))) == pytest.approx(exact, rel=1e-9)


def test_the_example_of_the_manual_is_read_as_its_lines_say(tmp_path: Path) -> None:
    found = re.search(r"```yaml\n  gripper:\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    body = load_config(write_arm(tmp_path, content(yaml.safe_load(found[1])))).bodies["lump"]
    assert isinstance(body, RigidBody)
    assert body.mass == 1.2 and body.com == pytest.approx([0.02, 0.0, 0.005])
    assert body.nodes["fingers"] == pytest.approx([0.08, 0.0, 0.0])
    tensor = 1e-6 * np.array([[700, 0, -60], [0, 900, 0], [-60, 0, 1100]])
    assert body.inertia == pytest.approx(tensor)


@pytest.mark.parametrize(
    ("listed", "said"),
    [
        ([1, 2, 2], "expected a list of 6: xx, yy, zz, xy, xz, yz"),
        (
            [1, 0, 0, 2, 0, 2],
            "expected xx, yy, zz, xy, xz, yz of the tensor about the centre of mass (not the ",
        ),
    ],
)
def test_moments_in_another_order_are_refused_with_the_right_one(
    listed: list[float], said: str, tmp_path: Path
) -> None:
    body = {"type": "rigid", "mass": "1 kg", "inertia": [f"{value} kg m^2" for value in listed]}
    path = write_arm(tmp_path, content(body))
    message = refusal(path)
    assert message.startswith(f"{path}: bodies.lump.inertia: ['1 kg m^2', ") and said in message
