"""A reduction is refused where a joint bears a moment of which it keeps no shape, and nowhere else."""

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


def lump_in_mid_span(folder: Path, axes: dict[str, Any], **reduction: Any) -> Path:
    """Write the four-bar with a body on its coupler between the ends, which is reduced as said."""
    lump = {"type": "rigid", "mass": "0.3 kg", "inertia": [*["2e-3 kg m^2"] * 3, *["0 kg m^2"] * 3]}
    weld = {"parent": "coupler.gauge", "child": "lump.root", "axes": axes}
    changes = {"reduction": {"method": "craig_bampton", **reduction}}
    return coupled(folder, {"weld": weld}, {"lump": lump}, **changes)


@pytest.mark.parametrize("frame", ["chord", "clamped"])
@pytest.mark.parametrize("axes", [{}, {"rz": {"stiffness": "1 N m/rad"}}])
def test_a_pinned_node_that_bears_a_moment_is_refused(
    tmp_path: Path, axes: dict[str, Any], frame: str
) -> None:
    """Its modes were 6 percent too fast, and to name it in ``retain`` did not help."""
    said = {"modes": 6, "frame": frame, "interface": "pinned", "retain": ["gauge"]}
    path = lump_in_mid_span(tmp_path, axes, **said)
    message = refusal(path)
    assert message.startswith(f"{path}: bodies.coupler.reduction.interface: 'pinned': ")
    assert "joint 'weld' bears one about z at 'coupler.gauge'" in message
    assert message.endswith("or interface: welded")


def test_a_pinned_node_with_a_hinge_and_a_pinned_end_of_a_clamped_beam_are_told_apart(tmp_path: Path) -> None:
    pinned = {"modes": 3, "frame": "clamped", "interface": "pinned"}
    load_config(lump_in_mid_span(tmp_path, {"rz": {"lower": "-1 rad"}}, **pinned))
    content = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    content["bodies"]["upper"]["reduction"].update(pinned)
    assert "bears one about z at 'upper.end'; expected only passive" in refusal(write_arm(tmp_path, content))


def test_a_twist_that_the_joints_of_a_pinned_beam_bear_is_refused(tmp_path: Path) -> None:
    pinned = {"method": "craig_bampton", "modes": 4, "frame": "chord", "interface": "pinned"}
    message = refusal(coupled(tmp_path, {}, {}, deformation=["bend_y", "torsion"], reduction=pinned))
    assert "joint 'elbow' bears one about x" in message or "joint 'hinge' bears one about x" in message
    welded = {"method": "craig_bampton", "modes": 4, "frame": "chord"}
    load_config(coupled(tmp_path, {}, {}, deformation=["bend_y", "torsion"], reduction=welded))


def test_what_is_welded_in_mid_span_has_the_modes_of_the_clamped_beam_in_a_chord_too(tmp_path: Path) -> None:
    """With six modes the second was 6 percent too fast unless ``retain`` named the node."""
    omega = [
        linearize(ReducedTree(load_config(path), use_compiler=False)).omega
        for path in (
            lump_in_mid_span(tmp_path, {}, modes=5, frame="chord"),
            lump_in_mid_span(tmp_path, {}, modes=12),
        )
    ]
    assert omega[0] == pytest.approx(omega[1], rel=1e-3)


def test_a_hub_at_a_hinge_counts_as_the_end(tmp_path: Path) -> None:
    content = yaml.safe_load((FOLDER / "four_bar.yaml").read_text(encoding="utf-8"))["bodies"]["coupler"]
    length = sum(float(piece["length"].split()[0]) for piece in content["pieces"])
    pieces = [*content["pieces"], {"length": "20 mm", "rigid": True}]
    nodes = {**content["nodes"], "hub": f"{length + 10} mm"}
    lump = {"type": "rigid", "mass": "1 kg", "inertia": [*["1e-3 kg m^2"] * 3, *["0 kg m^2"] * 3]}
    weld = {"parent": "coupler.hub", "child": "lump.root"}
    path = coupled(tmp_path, {"weld": weld}, {"lump": lump}, pieces=pieces, nodes=nodes)
    assert "bears one about z at 'coupler.hub'" in refusal(path)
