"""The description is strict: an error names file, key, value and what is allowed.

Every case is an edit of the shipped single link: text that is replaced, and what the message must say.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from arms import FOLDER, SINGLE_LINK, arm
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import NodeRef
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

TEXT = SINGLE_LINK.read_text(encoding="utf-8")


def bias_text(sigma: str, limit: str, drift: str = "0 rad/sqrt(s)") -> str:
    """Return the encoder's noise and bias as YAML."""
    return f"sigma: 20 urad, bias: {{sigma: {sigma}, drift: {drift}, limit: {limit}}}"


# (what it is, text replaced, by what, what the message must name: key, value, what is allowed)
SHORT = """      - length: 10 um
        section: {shape: rectangle, along_y: 3.2 mm, along_z: 20 mm}
        youngs_modulus: 208.5 GPa
        shear_modulus: 80 GPa
        density: 7750 kg/m^3
        elements: 2
      - length: 630 mm"""
EDITS = [
    ("unknown key", "along_y:", "along_yy:", ("bodies.strip.pieces.0.section", "along_y")),
    ("unknown key at the top", "gravity:", "gravitiy:", ("gravity", "must be given")),
    ("extra key", "tip: strip.tip", "tip: strip.tip\ncolour: red", ("colour", "'red'", "unknown key")),
    ("missing key", "    damping_ratio: 0.015\n", "", ("bodies.strip.damping_ratio", "must be given")),
    ("wrong unit", "length: 630 mm", "length: 630 kg", ("pieces.0.length", "'630 kg'", "m, mm, um")),
    ("misspelt key", "- length: 630 mm", "- lenght: 630 mm", ("0.length: is missing", "not 'lenght'")),
    ("no space", "length: 630 mm", "length: 630mm", ("pieces.0.length", "'630mm'", "no unit after a space")),
    ("bare number", "mass: 54 g", "mass: 54", ("point_masses.0.mass", "54", "kg, g")),
    ("length for an angle", "lower: -170 deg", "lower: -170 mm", ("axes.rz.lower", "'-170 mm'", "rad, mrad")),
    ("force for a torque", "effort: 28 N m", "effort: 28 N", ("axes.rz.effort", "'28 N'", "N m, mN m")),
    ("mass for an inertia", "inertia: 0.30 kg m^2", "inertia: 0.30 kg", ("rz.rotor_inertia", "kg m^2")),
    ("length for a home angle", "home: [0 deg]", "home: [0 mm]", ("served.home", "0 mm", "rad")),
    ("length for an encoder", "sigma: 20 urad", "sigma: 20 um", ("sensors.encoder.sigma", "20 um", "rad")),
    ("negative mass", "mass: 54 g", "mass: -54 g", ("point_masses.0.mass", "'-54 g'", "must be above 0")),
    ("negative body mass", "mass: 0 kg", "mass: -1 kg", ("bodies.hub.mass", "'-1 kg'", "must be at least 0")),
    ("not a number", "density: 7750 kg/m^3", "density: .nan kg/m^3", ("density", "not a number")),
    ("NaN", "density: 7750 kg/m^3", "density: nan kg/m^3", ("pieces.0.density", "must be finite")),
    ("YAML's NaN", "damping_ratio: 0.015", "damping_ratio: .nan", ("damping_ratio", "must be finite")),
    ("infinite modulus", "208.5 GPa\n        sh", "inf GPa\n        sh", ("modulus", "must be finite")),
    ("zero length", "length: 630 mm", "length: 0 mm", ("pieces.0.length", "must be above 0")),
    ("stiffer in shear", "modulus: 80 GPa", "modulus: 210 GPa", ("0.shear_modulus", "2.085e+11 Pa")),
    ("zero elements", "elements: 16", "elements: 0", ("elements", "0", "whole number, at least 1")),
    ("too many elements", "elements: 16", "elements: 99999", ("elements", "99999", "at most 200")),
    ("half an element", "elements: 16", "elements: 1.5", ("elements", "1.5", "whole number")),
    ("short elements", "      - length: 630 mm", SHORT, ("strip.pieces.0.elements: 2", "5e-06 m long")),
    ("no pieces", "    pieces:\n", "    pieces: []\n    assumed:\n", ("strip.pieces", "at least one")),
    ("mass beyond the end", "at: 620 mm", "at: 640 mm", ("point_masses.0.at", "'640 mm'", "0.63 m")),
    ("no such node", "node: strip.gauge", "node: strip.gage", ("strain.node", "strip.gage", "strip.gauge")),
    ("no such axis", "axis: base.rz", "axis: base.rx", ("encoder.axis", "base.rx", "base.rz")),
    ("no such kind", "kind: encoder", "kind: resolver", ("encoder.kind", "resolver", "strain_gauge")),
    ("no such body type", "type: rigid", "type: stiff", ("bodies.hub.type", "stiff", "rigid, beam")),
    ("no such shape", "shape: rectangle", "shape: square", ("shape", "square", "rectangle, tube, given")),
    ("no such method", "craig_bampton", "craig", ("reduction.method", "craig", "craig_bampton, guyan")),
    ("no such deformation", "[bend_y]", "[bend]", ("deformation", "bend_y, bend_z, torsion, stretch")),
    ("deformation twice", "[bend_y]", "[bend_y, bend_y]", ("deformation", "each once")),
    ("no deformation", "[bend_y]", "[]", ("strip.deformation", "at least 1 of bend_y, bend_z, torsion")),
    ("no axes", "axes: [y]", "axes: []", ("accelerometer.axes", "[]", "at least 1 of x, y, z")),
    ("range crossed", "sigma: 20 urad", "sigma: 20 urad, low: 9 deg, high: -9 deg", ("encoder.high", "-9")),
    ("range empty", "sigma: 20 urad", "sigma: 20 urad, low: 9 deg, high: 9 deg", ("high", "0.15708 rad")),
    ("low too high", "sigma: 20 urad", "sigma: 20 urad, low: 1e4 rad", ("encoder.low", "1e4 rad", "below")),
    ("dangling body", "child: strip.root", "child: hub.root", ("clamp.child", "hub.root", "another body")),
    ("disconnected graph", "parent: world", "parent: strip.tip", ("base.parent", "not connected to")),
    ("joint onto the world", "child: strip.root", "child: world", ("clamp.child", "world")),
    ("limits crossed", "upper: 170 deg", "upper: -171 deg", ("axes.rz.upper", "above lower, -170 deg")),
    ("no such axis name", "      rz:\n", "      yaw:\n", ("base.axes.yaw", "unknown key", "rx, ry, rz")),
    ("flag as text", "actuated: true", "actuated: motor", ("axes.rz.actuated", "motor", "true or false")),
    ("list too short", "[10 mm, 0 mm, 0 mm]", "[10 mm]", ("clamp.position", "a list of 3")),
    ("not a list", "position: [10 mm, 0 mm, 0 mm]", "position: 10 mm", ("clamp.position", "a list of 3")),
    ("home too long", "home: [0 deg]", "home: [0 deg, 0 deg]", ("a list of 1", "true, base.rz")),
    ("forgotten motor", "        actuated: true\n", "", ("axes.rz.effort", "no effect", "actuated: true")),
    ("home out of range", "home: [0 deg]", "home: [200 deg]", ("served.home", "'200 deg'", "2.96706] rad")),
    ("pose out of range", "served: {", "served: {poses: {a: [-9 rad]}, ", ("poses.a", "'-9 rad'", "base.rz")),
    ("wrong kind", "  strip:\n    type: beam\n", "  strip: 5\n  a:\n    type: beam\n", ("strip", "mapping")),
    ("text for a mapping", "served: {modes: 3", "served: fast #", ("served", "fast", "a mapping")),
    ("number for a name", "name: single_link", "name: 5", ("name", "5", "a text")),
    ("unknown format", "flexarm/1", "flexarm/2", ("format", "flexarm/2", "flexarm/1")),
    ("duplicate key", "tip: strip.tip", "tip: strip.tip\ntip: strip.sensor", ("'tip'", "given twice")),
    ("second root", "nodes: {gauge", "nodes: {root: 1 mm, gauge", ("nodes.root", "other than root")),
    ("dot in a name", "  encoder: {", "  en.coder: {", ("sensors.en.coder", "without a dot")),
    ("sensor called tip", "  encoder: {", "  tip: {", ("sensors.tip", "other than tip")),
    ("body called world", "  hub:  ", "  world:  ", ("bodies.world", "other than world")),
    ("number as a key", "nodes: {gauge", "nodes: {1: 5 mm, gauge", ("line ", "key '1' is read as 1")),
    ("yes as a key", "source:", "on: 1\nsource:", ("line ", "key 'on' is read as True", "quotes")),
    ("date as a key", "source:", "2020-01-01: 1\nsource:", ("key '2020-01-01' is read as", "must be text")),
    ("null as a key", "source:", "null: 1\nsource:", ("key 'null' is read as None", "must be text")),
    ("list as a key", "source:", "? [a]\n: 1\nsource:", ("key a list", "['a']", "must be text")),
    ("number in a pose", "served: {", "served: {poses: {1: [0 deg]}, ", ("key '1' is read as 1", "quotes")),
    ("merge key", "source:", "a: &a {b: 1}\nc: {<<: *a}\nsource:", ("line ", "'<<'", "write their keys out")),
    ("alias in itself", "source:", "foo: &foo [*foo]\nsource:", ("foo.0: holds itself by an alias",)),
    ("mapping in itself", "source:", "foo: &foo {a: *foo}\nsource:", ("foo.a: holds itself by an alias",)),
    ("date that is none", "source:", "foo: 2020-13-45\nsource:",
     ("'2020-13-45' is read as timestamp and is none (month must be in 1..12)", "write a text in quotes")),
    ("number without digits", "source:", "foo: 0x_\nsource:", ("'0x_' is read as int and is none",)),
    ("date by its tag", "source:", "foo: !!timestamp soon\nsource:", ("'soon' is read as timestamp",)),
    ("nested too deeply", "source:", "a: " + "[" * 3000 + "\nsource:", ("nested too deeply",)),
    ("nested after a remark", "source:", "#" + "]" * 3000 + "\na: " + "[" * 3000, ("nested too deeply",)),
    ("nested by dashes", "source:", "a:\n  " + "- " * 300_000 + "b\nsource:", ("nested too deeply",)),
    ("not YAML", "presets:", "presets: [", ("is not YAML",)),
    ("unknown unit of a rate", "rate: 30 Hz", "rate: 30 fps", ("camera.rate", "30 fps", "Hz, kHz")),
    ("rate in a wrong unit", "rate: 200 Hz", "rate: 200 kHz", ("served.rate", "200 kHz", "[1, 10000] Hz")),
    ("rate too slow", "rate: 200 Hz", "rate: 0.9 Hz", ("served.rate", "'0.9 Hz'", "[1, 10000] Hz")),
    ("negative latency", "latency: 60 ms", "latency: -60 ms", ("camera.latency", "must be at least 0")),
    ("delay without a unit", "latency: 60 ms", "stamp_delay: 60", ("camera.stamp_delay", "60", "ms")),
    ("delay too long", "latency: 60 ms", "stamp_delay: 60 s", ("stamp_delay", "60 s", "-100 ms to 1000 ms")),
    ("guess of a motor", "      rz:\n", "      rz:\n        guess: 5 deg\n", ("rz.guess", "5 deg", "home")),
    ("half a bias", "sigma: 20 urad", "sigma: 20 urad, bias: {sigma: 1 mrad}", ("bias.drift", "be given")),
    ("bias of a gauge in mm", "sigma: 20 urad", bias_text("1 mm", "1 mrad"), ("bias.sigma", "1 mm", "rad")),
    ("drift without sqrt", "sigma: 20 urad", bias_text("1 mrad", "2 mrad", "1 mrad/s"), ("rad/sqrt(s)",)),
    ("limit below sigma", "sigma: 20 urad", bias_text("3 mrad", "2 mrad"), ("limit", "2 mrad", "one sigma")),
    ("unknown key of a bias", "sigma: 20 urad", bias_text("1 mrad", "2 mrad, mean: 0"), ("mean", "drift")),
    ("bias of a camera", "latency: 60 ms", "bias: {sigma: 1 mm}", ("camera.bias", "unknown key")),
]  # fmt: skip


def refused(path: Path, text: str, preset: str = "") -> str:
    """Return the message with which ``text`` is refused; it names the file."""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_config(path, preset)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value)


@pytest.mark.parametrize("edit", EDITS, ids=[edit[0] for edit in EDITS])
def test_a_wrong_description_is_refused_by_name(
    edit: tuple[str, str, str, tuple[str, ...]], tmp_path: Path
) -> None:
    _, old, new, expected = edit
    assert TEXT.count(old) >= 1, "the edit no longer applies"
    message = refused(tmp_path / "arm.yaml", TEXT.replace(old, new, 1))
    for fragment in expected:
        assert fragment in message


def test_aliases_that_multiply_are_counted_and_refused(tmp_path: Path) -> None:
    text = "a0: &a0 [1]\n"
    text += "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 30))  # 9^29 in full
    assert "stand for more than 100000 values" in refused(tmp_path / "arm.yaml", text)


def edited(**changes: Any) -> str:
    """Return the single link with values changed or added, by dotted path with "__" for dots."""
    content = yaml.safe_load(TEXT)
    for path, value in changes.items():
        *parents, last = path.split("__")
        target = content
        for part in parents:
            target = target[part]
        target[last] = value
    return yaml.safe_dump(content, sort_keys=False)


def test_a_body_without_a_joint_dangles(tmp_path: Path) -> None:
    message = refused(tmp_path / "arm.yaml", edited(bodies__cup={"type": "rigid", "mass": "1 kg"}))
    assert "bodies.cup" in message and "dangles" in message


def test_a_second_joint_to_a_placed_body_closes_a_loop(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(
        edited(joints__again={"parent": "world", "child": "strip.tip", "axes": {"rz": {"guess": "20 deg"}}})
    )
    config = load_config(tmp_path / "arm.yaml")
    assert [joint.name for joint in config.closures] == ["again"]
    assert "again" not in [joint.name for joint in config.joints]
    assert config.axes["again.rz"].guess == pytest.approx(np.radians(20.0))


@pytest.mark.parametrize(("key", "value"), [("effort", "28 N m"), ("effort_rate", "9 N m/s")])
def test_the_limits_of_a_motor_are_refused_where_there_is_none(tmp_path: Path, key: str, value: str) -> None:
    again = {"parent": "world", "child": "strip.tip", "axes": {"rz": {"guess": "20 deg", key: value}}}
    message = refused(tmp_path / "arm.yaml", edited(joints__again=again))
    assert f"joints.again.axes.rz.{key}: '{value}': has no effect; it is of a motor" in message
    assert "actuated: true" in message


def test_a_home_of_an_arm_without_motors_is_empty(tmp_path: Path) -> None:
    text = edited(joints__base__axes={"rz": {"stiffness": "9 N m/rad"}})
    message = refused(tmp_path / "arm.yaml", text)
    assert (
        "served.home: ['0 deg']: expected a list of 0, for the axes with actuated: true, here none" in message
    )


def test_a_rigid_piece_has_no_mass_and_no_material(tmp_path: Path) -> None:
    content = yaml.safe_load(TEXT)
    strip = content["bodies"]["strip"]
    strip["pieces"].append({"length": "18 mm", "rigid": True})
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(content))
    beam = load_config(tmp_path / "arm.yaml").bodies["strip"]
    assert isinstance(beam, Beam) and beam.pieces[1].rigid and beam.pieces[1].density == 0.0
    assert not beam.pieces[0].rigid


def test_poses_are_named_and_of_the_length_of_home(tmp_path: Path) -> None:
    served = {"modes": 3, "home": ["0 deg"], "rate": "200 Hz", "poses": {"far": ["60 deg"]}}
    (tmp_path / "arm.yaml").write_text(edited(served=served))
    np.testing.assert_allclose(load_config(tmp_path / "arm.yaml").poses["far"], [np.pi / 3])
    served["poses"] = {"far": ["60 deg", "1 deg"]}
    assert "served.poses.far" in refused(tmp_path / "arm.yaml", edited(served=served))


def test_bodies_that_hold_only_each_other_are_not_connected(tmp_path: Path) -> None:
    a, b = ({"type": "rigid", "mass": "1 kg"} for _ in range(2))
    joints = {"ab": {"parent": "a.root", "child": "b.root"}, "ba": {"parent": "b.root", "child": "a.root"}}
    content = yaml.safe_load(TEXT)
    text = edited(bodies={**content["bodies"], "a": a, "b": b}, joints={**content["joints"], **joints})
    assert "not connected to the world" in refused(tmp_path / "arm.yaml", text)


def test_an_axis_without_content_is_not_dropped(tmp_path: Path) -> None:
    assert "joints.base.axes.rz" in refused(tmp_path / "arm.yaml", edited(joints__base__axes={"rz": None}))


@pytest.mark.parametrize("inertia", [[-1, 1, 1, 0, 0, 0], [1, 1, 3, 0, 0, 0], [1, 1, 1, 2, 0, 0]])
def test_an_inertia_that_no_body_can_have_is_refused(inertia: list[float], tmp_path: Path) -> None:
    text = edited(bodies__hub__inertia=[f"{value} kg m^2" for value in inertia])
    assert "bodies.hub.inertia" in refused(tmp_path / "arm.yaml", text)


@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        ("", "must hold keys"),
        ("- a\n- b\n", "must hold keys"),
        ("\tx: 1", "is not YAML"),
        ("a: *b", "is not YAML"),
    ],
)
def test_what_is_not_a_mapping_is_refused(content: str, fragment: str, tmp_path: Path) -> None:
    assert fragment in refused(tmp_path / "arm.yaml", content)


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    (tmp_path / "latin.yaml").write_bytes(b"name: \xff")
    for path, fragment in (
        (tmp_path / "none.yaml", "cannot be read"),
        (tmp_path / "latin.yaml", "not UTF-8"),
    ):
        with pytest.raises(ConfigError, match=fragment):
            load_config(path)


def test_an_unknown_preset_is_refused_with_those_there_are(tmp_path: Path) -> None:
    message = refused(tmp_path / "arm.yaml", TEXT, preset="heavy_hub")
    assert "presets" in message and "heavy_hub" in message and "geared, light_hub, printed" in message


@pytest.mark.parametrize(
    "path", ["joints.base.axes.rz.rotor", "bodies.strip.pieces.1.length", "name.first", "tip.0"]
)
def test_a_preset_that_changes_nothing_is_refused_even_unused(path: str, tmp_path: Path) -> None:
    message = refused(tmp_path / "arm.yaml", edited(presets__geared={path: "1 kg m^2"}))
    assert f"presets.geared.{path}" in message and "changes values that exist" in message


def test_a_preset_may_change_an_element_of_a_list(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(edited(presets__geared={"joints.clamp.position.0": "12 mm"}))
    clamp = load_config(tmp_path / "arm.yaml", "geared").joints[1]
    np.testing.assert_allclose(clamp.placement[:3, 3], [0.012, 0.0, 0.0])


def test_a_preset_is_judged_like_the_file(tmp_path: Path) -> None:
    text = edited(presets__geared={"joints.base.axes.rz.rotor_inertia": "0.3 kg"})
    assert "joints.base.axes.rz.rotor_inertia" in refused(tmp_path / "arm.yaml", text, preset="geared")


FREE = {"sensors", "presets"}  # their keys are names that the user gives and that nothing refers to


def keys(content: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items = (
        content.items()
        if isinstance(content, dict)
        else enumerate(content)
        if isinstance(content, list)
        else ()
    )
    for key, value in items:
        if (
            isinstance(content, dict)
            and not (path and path[-1] in FREE)
            and (*path, key) != ("joints", "clamp")
        ):
            yield (*path, key)
        yield from keys(value, (*path, key))


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(list(keys(yaml.safe_load(TEXT)))), st.text("abcdefgh_", min_size=1, max_size=8))
def test_any_key_renamed_is_refused(tmp_path: Path, path: tuple[Any, ...], name: str) -> None:
    content = copy.deepcopy(yaml.safe_load(TEXT))
    target = content
    for part in path[:-1]:
        target = target[part]
    if name not in target:
        target[name] = target.pop(path[-1])
        refused(tmp_path / "arm.yaml", yaml.safe_dump(content))


def test_the_shipped_file_is_read_as_the_source_prints_it() -> None:
    config = arm("single_link", "light_hub")
    strip = config.bodies["strip"]
    assert isinstance(strip, Beam)
    assert strip.length == pytest.approx(0.63) and strip.nodes == {
        "root": 0.0,
        "gauge": 0.005,
        "sensor": 0.62,
        "tip": 0.63,
    }
    assert strip.pieces[0].I_z == pytest.approx(0.020 * 0.0032**3 / 12)
    assert config.tip == NodeRef("strip", "tip") and config.actuated["base.rz"].rotor_inertia == 0.01
    assert np.degrees(config.actuated["base.rz"].upper) == pytest.approx(170)


def test_the_identity_follows_the_content_and_not_the_preset_name(tmp_path: Path) -> None:
    plain, geared, light = (arm("single_link", preset).config_id for preset in ("", "geared", "light_hub"))
    assert plain == geared != light
    (tmp_path / "arm.yaml").write_text("# a comment\n" + TEXT, encoding="utf-8")
    assert load_config(tmp_path / "arm.yaml").config_id == plain


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.yaml")))
def test_joints_are_sorted_from_the_world_outwards(name: str) -> None:
    placed = {"world"}
    for joint in arm(name).joints:
        assert joint.parent.body in placed
        placed.add(joint.child.body)
    assert placed == {"world", *arm(name).bodies}


def test_how_late_a_driver_stamps_is_read_and_nothing_by_default(tmp_path: Path) -> None:
    text = TEXT.replace("latency: 60 ms", "latency: 60 ms, stamp_delay: -2.5 ms", 1)
    (tmp_path / "arm.yaml").write_text(text)
    delays = {spec.name: spec.stamp_delay for spec in load_config(tmp_path / "arm.yaml").sensors}
    assert delays.pop("camera") == -0.0025
    assert set(delays.values()) == {0.0}


def test_a_bias_is_read_in_si_and_a_sensor_without_the_key_has_none(tmp_path: Path) -> None:
    text = "bias: {sigma: 20 ustrain, drift: 0.5 ustrain/sqrt(s), limit: 200 ustrain, rate: 0.3 ustrain/s}"
    content = yaml.safe_load(TEXT)
    for sensor in content["sensors"].values():
        sensor.pop("bias", None)
    content["sensors"]["root_strain"].update(yaml.safe_load(text))
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(content))
    biases = {spec.name: spec.bias for spec in load_config(tmp_path / "arm.yaml").sensors}
    bias = biases.pop("root_strain")
    assert bias is not None
    assert (bias.sigma, bias.drift, bias.limit) == pytest.approx((20e-6, 0.5e-6, 200e-6), rel=1e-12)
    assert (bias.rate, bias.rate_time) == pytest.approx((0.3e-6, 60.0), rel=1e-12)
    assert set(biases.values()) == {None}


def test_a_long_value_does_not_hide_what_is_allowed(tmp_path: Path) -> None:
    message = refused(tmp_path / "arm.yaml", TEXT.replace("sensors:", "sensorz:", 1))
    assert "sensorz: " in message
    assert "... : unknown key; allowed here: assumed, bodies" in message.replace(" ...:", " ... :")
    assert len(message) < 400 + len(str(tmp_path))


@pytest.mark.parametrize(
    ("changes", "low", "high"),
    [
        ({}, -np.radians(170) - 0.6, np.radians(170) + 0.6),  # 0.1 s at 6 rad/s beyond the range
        ({"velocity: 6 rad/s\n": "velocity: 1 rad/s\n"}, -np.radians(170) - 0.1, np.radians(170) + 0.1),
        ({"velocity: 6 rad/s\n": "\n"}, -np.radians(510), np.radians(510)),  # as far as the range is wide
        ({"        lower: -170 deg\n": ""}, -100.0, np.radians(170) + 0.6),
        ({"        lower: -170 deg\n        upper: 170 deg\n": ""}, -100.0, 100.0),
        ({"sigma: 20 urad": "sigma: 20 urad, low: -9 rad"}, -9.0, np.radians(170) + 0.6),
    ],
)
def test_an_encoder_says_nothing_that_its_axis_cannot_reach(
    changes: dict[str, str], low: float, high: float, tmp_path: Path
) -> None:
    text = TEXT
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "arm.yaml"
    path.write_text(text, encoding="utf-8")
    (encoder,) = [sensor for sensor in load_config(path).sensors if sensor.kind == "encoder"]
    assert (encoder.low, encoder.high) == pytest.approx((low, high))


@pytest.mark.parametrize("path", sorted(SINGLE_LINK.parent.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_range_of_an_axis_is_well_inside_that_of_its_encoder(path: Path) -> None:
    """The outermost hundredth of half a sensor's range is taken for clipped: no axis may stand there."""
    config = load_config(path)
    for sensor in config.sensors:
        if sensor.kind == "encoder" and np.isfinite((axis := config.axes[sensor.site]).upper - axis.lower):
            clipped = 0.01 * (sensor.high - sensor.low) / 2
            assert sensor.low + clipped < axis.lower < axis.upper < sensor.high - clipped
