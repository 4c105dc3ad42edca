"""Read a manipulator's YAML into a ``ManipulatorConfig``; refuse whatever is not understood."""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.body_spec import Body
from flexarm_model.manipulator.description import Axis, Joint, ManipulatorConfig
from flexarm_model.manipulator.imported_body import ImportedBody, SuperelementBody
from flexarm_model.manipulator.parameter_law import ParameterLaws, read_parameters
from flexarm_model.reading.config_bodies import read_bodies, read_node
from flexarm_model.reading.config_chord import refuse_moments_not_kept
from flexarm_model.reading.config_joints import read_joints, refuse_idle_guesses, sort_joints
from flexarm_model.reading.config_sensors import read_sensors
from flexarm_model.settings.strict_yaml import ConfigError, Section, read_yaml
from flexarm_model.settings.units import axis_dimension, si_unit

FORMAT = "flexarm/1"
RATES = (1.0, 1e4)  # Hz; what the control period may be, and no typing error: 250 kHz where 250 Hz is meant
FROM_FILES = (ImportedBody, SuperelementBody)  # their content is part of the identity


def load_config(
    path: str | Path, preset: str = "", changes: Mapping[str, Any] | None = None
) -> ManipulatorConfig:
    """Load and check a manipulator.

    Args:
        path: YAML file.
        preset: Name of one of the file's presets; "" applies none.
        changes: More values of the file, by dotted path, on top of the preset's.

    Raises:
        ConfigError: Anything is wrong with the file; names file, key, value and what is allowed.
    """
    path = Path(path)
    content = read_content(path, preset, changes or {})
    top = Section(content, str(path))
    top.take("format")
    bodies = read_bodies(top)
    parameters = read_parameters(top)
    laws = ParameterLaws(parameters)
    joints, closures = sort_joints(top, read_joints(top, bodies, laws), bodies)
    refuse_idle_guesses(top, joints, closures)
    laws.refuse_unused(top)
    refuse_moments_not_kept(top, bodies, (*joints, *closures))
    config = ManipulatorConfig(
        name=top.text("name"),
        source=top.text("source"),
        preset=preset,
        config_id=_identify(content, bodies),
        gravity=top.quantities("gravity", ["acceleration"] * 3),
        bodies=bodies,
        joints=joints,
        closures=closures,
        tip=(tip := read_node(top, "tip", bodies)),
        sensors=read_sensors(top, joints, closures, bodies, tip),
        assumed=top.texts("assumed", ()),
        fitted=top.texts("fitted", ()),
        parameters={name: parameter.value for name, parameter in parameters.items()},
        laws=tuple(laws.found),
        **_read_served(top.section("served"), (*joints, *closures)),
    )
    for _, unused in top.sections("presets", {}):
        _change(content, unused)
    top.done()
    return config


def _read_served(served: Section, joints: Sequence[Joint]) -> dict[str, Any]:
    """Return what is served: modes, rate, home and further poses."""
    actuated = {f"{joint.name}.{axis.name}": axis for joint in joints for axis in joint.axes if axis.actuated}
    poses = served.section("poses", {})
    read = {
        "modes": served.count("modes", at_least=0),
        "home": _read_pose(served, "home", actuated),
        "rate_hz": _read_rate(served),
        "poses": {name: _read_pose(poses, name, actuated) for name in poses.names(taken=("home",))},
    }
    served.done()
    return read


def _read_rate(served: Section) -> float:
    """Return the control rate [Hz], which the control period of a law must allow."""
    rate = served.quantity("rate", "frequency", above=0.0)
    if not RATES[0] <= rate <= RATES[1]:
        raise served.error("rate", served.take("rate"), f"must lie within [{RATES[0]:g}, {RATES[1]:g}] Hz")
    return rate


def _read_pose(section: Section, key: str, actuated: Mapping[str, Axis]) -> NDArray[np.float64]:
    """Return a pose within the ranges of the actuated axes, (n_theta,)."""
    dimensions = [axis_dimension(axis.name, "position") for axis in actuated.values()]
    if not isinstance(given := section.take(key), list) or len(given) != len(actuated):
        driven = f"for the axes with actuated: true, {', '.join(actuated) or 'here none'}"
        raise section.error(key, given, f"expected a list of {len(actuated)}, {driven}")
    pose = section.quantities(key, dimensions)
    for i, (name, axis) in enumerate(actuated.items()):
        if not axis.lower <= pose[i] <= axis.upper:
            unit = si_unit(dimensions[i])
            allowed = f"{name} must lie within [{axis.lower:.6g}, {axis.upper:.6g}] {unit}"
            raise section.error(key, section.take(key)[i], allowed)
    return pose


def _identify(content: dict[str, Any], bodies: dict[str, Body]) -> str:
    described = {key: content[key] for key in content if key != "presets"}
    files = {name: body.digest for name, body in bodies.items() if isinstance(body, FROM_FILES)}
    if files:
        described["files"] = files
    return hashlib.sha256(json.dumps(described, sort_keys=True, default=str).encode()).hexdigest()[:16]


def read_content(path: Path, preset: str = "", changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return what a description says with a preset and changes in force, as it is written.

    Args:
        path: The file.
        preset: Name of one of its presets; "" applies none.
        changes: Further values by dotted path.

    Raises:
        ConfigError: It is no description, or changes a value that is not there.
    """
    read = read_yaml(path)
    Section(read, str(path)).choice("format", (FORMAT,))  # before presets: those of a moves file are others
    content = _apply_preset(read, preset, str(path))
    return _change(content, Section(dict(changes or {}), str(path)))


def _apply_preset(content: dict[str, Any], preset: str, path: str) -> dict[str, Any]:
    presets = dict(Section(content, path).sections("presets", {}))
    if preset and preset not in presets:
        allowed = f"no such preset; the file has {', '.join(presets) or 'none'}"
        raise Section(content, path).error("presets", preset, allowed)
    return _change(content, presets[preset]) if preset else content


def _change(content: dict[str, Any], preset: Section) -> dict[str, Any]:
    """Return the content with the values of a preset, each under its dotted path."""
    changed = copy.deepcopy(content)
    for dotted in preset.names(dots=True):
        *parents, last = dotted.split(".")
        target: Any = changed
        try:
            for part in parents:
                target = target[_index(target, part)]
            _ = target[_index(target, last)]
        except (KeyError, IndexError, ValueError, TypeError):
            raise preset.error(dotted, preset.take(dotted), "a preset changes values that exist") from None
        target[_index(target, last)] = preset.take(dotted)
    return changed


def _index(target: object, part: str) -> Any:
    return int(part) if isinstance(target, list) else part


__all__ = ["ConfigError", "load_config", "read_content"]
