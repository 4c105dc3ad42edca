"""A chord frame is refused where a joint bears a bending moment of the beam's end, and nowhere else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from arms import FOLDER
from descriptions import refusal, write_arm

from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = FOLDER.parents[3] / "docs/two_link.yaml"
CHORD = {"method": "craig_bampton", "modes": 3, "frame": "chord"}
PINNED = {**CHORD, "interface": "pinned"}


def driven(folder: Path, reduction: dict[str, Any]) -> Path:
    """Write the arm of the manual with another reduction of its upper link, which two motors turn."""
    content = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    content["bodies"]["upper"]["reduction"] = reduction
    return write_arm(folder, content)


def coupled(folder: Path, joints: dict[str, Any], bodies: dict[str, Any], **changes: Any) -> Path:
    """Write the four-bar with joints and bodies added or changed, and the coupler's entries changed."""
    content = yaml.safe_load((FOLDER / "four_bar.yaml").read_text(encoding="utf-8"))
    content["joints"].update(joints)
    content["bodies"].update(bodies)
    content["bodies"]["coupler"].update(changes)
    return write_arm(folder, content)


@pytest.mark.parametrize(
    ("reduction", "node"),
    [
        (CHORD, "root"),
        (PINNED, "root"),
        ({**CHORD, "retain": ["root"]}, "end"),
        ({**PINNED, "retain": ["root", "end"]}, "root"),  # pinned keeps the place of a node alone
    ],
)
def test_a_chord_between_motors_and_welds_is_refused(
    tmp_path: Path, reduction: dict[str, Any], node: str
) -> None:
    message = refusal(path := driven(tmp_path, reduction))
    assert message.startswith(f"{path}: bodies.upper.reduction.frame: 'chord': ")
    assert f"about z at 'upper.{node}'; expected only passive hinges there" in message
    assert f"with '{node}' in retain" in message


def test_a_chord_that_keeps_its_driven_ends_has_the_modes_of_the_clamped_link(tmp_path: Path) -> None:
    path = driven(tmp_path, {**CHORD, "retain": ["root", "end"]})
    kept, clamped = (linearize(ReducedTree(load_config(p), use_compiler=False)).omega for p in (path, ARM))
    assert kept == pytest.approx(clamped, rel=1e-6)


@pytest.mark.parametrize(
    "axes",
    [
        {},
        {"rz": {"guess": "-50 deg", "stiffness": "1 N m/rad"}},
        {"rx": {"guess": "-50 deg"}},
        {"tx": {}, "ty": {}},
    ],
)
def test_an_end_that_cannot_turn_freely_is_refused(tmp_path: Path, axes: dict[str, Any]) -> None:
    elbow = {"parent": "crank.end", "child": "coupler.root", "axes": axes}
    assert "joint 'elbow' bears one about z" in refusal(coupled(tmp_path, {"elbow": elbow}, {}))


def test_what_a_massless_body_bears_is_what_its_other_joints_bear(tmp_path: Path) -> None:
    bodies = {"mount": {"type": "rigid", "mass": "0 kg"}}
    weld = {"parent": "coupler.end", "child": "mount.root", "orientation": ["90 deg", "0 deg", "0 deg"]}
    load_config(coupled(tmp_path, {"mount": weld}, bodies))  # a turned seat of a sensor bears nothing
    bodies["lump"] = {"type": "rigid", "mass": "1 kg", "com": ["10 mm", "0 mm", "0 mm"]}
    hung = {"parent": "mount.root", "child": "lump.root"}
    for axes, bears in (({"ry": {}}, False), ({"rz": {}}, True), ({}, True)):  # its y is the coupler's -z
        path = coupled(tmp_path, {"mount": weld, "hung": {**hung, "axes": axes}}, bodies)
        if bears:
            assert "joint 'mount' bears one about z at 'coupler.end'" in refusal(path)
        else:
            load_config(path)


def test_a_hub_at_a_hinge_counts_as_the_end(tmp_path: Path) -> None:
    content = yaml.safe_load((FOLDER / "four_bar.yaml").read_text(encoding="utf-8"))["bodies"]["coupler"]
    length = sum(float(piece["length"].split()[0]) for piece in content["pieces"])
    pieces = [*content["pieces"], {"length": "20 mm", "rigid": True}]
    nodes = {**content["nodes"], "hub": f"{length + 10} mm"}
    lump = {"type": "rigid", "mass": "1 kg", "inertia": [*["1e-3 kg m^2"] * 3, *["0 kg m^2"] * 3]}
    weld = {"parent": "coupler.hub", "child": "lump.root"}
    path = coupled(tmp_path, {"weld": weld}, {"lump": lump}, pieces=pieces, nodes=nodes)
    assert "bears one about z at 'coupler.hub'" in refusal(path)
    weld["parent"] = "coupler.gauge"
    load_config(coupled(tmp_path, {"weld": weld}, {"lump": lump}, pieces=pieces, nodes=nodes))
