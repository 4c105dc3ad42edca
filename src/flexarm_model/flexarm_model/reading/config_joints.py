"""Read the joints of a manipulator's YAML; sort out those that place a body and those that close a loop."""

from __future__ import annotations

import math

from flexarm_model.manipulator.body_spec import Body
from flexarm_model.manipulator.description import AXES, WORLD, Axis, Joint
from flexarm_model.manipulator.loop_joints import joints_in_loops
from flexarm_model.manipulator.parameter_law import ParameterLaws
from flexarm_model.reading.config_bodies import read_node
from flexarm_model.reading.config_placement import read_placement
from flexarm_model.settings.strict_yaml import Section
from flexarm_model.settings.units import axis_dimension, si_unit

OF_SPRINGS = {"damping_ratio": "of the modes", "backlash": "the play"}  # what nothing but a spring has
OF_MOTORS = ("effort", "effort_rate")
MOST_PLAY = 0.5  # rad or m; more is a slip of the unit


def read_joints(top: Section, bodies: dict[str, Body], laws: ParameterLaws) -> list[Joint]:
    """Return the joints in the order of the file.

    Args:
        top: The whole file.
        bodies: By name.
        laws: Reads coefficients, and keeps those that follow a parameter.

    Raises:
        ConfigError: A joint or an axis says what it must not.
    """
    joints = []
    for name, section in top.sections("joints"):
        placement = read_placement(section)
        axes_section = section.section("axes", {})
        axes = [
            _read_axis(axes_section.section(axis), f"{name}.{axis}", laws)
            for axis in AXES
            if axes_section.has(axis)
        ]
        axes_section.done()
        parent, child = read_node(section, "parent", bodies), read_node(section, "child", bodies)
        if child.body == WORLD or parent.body == child.body:
            raise section.error("child", str(child), "must be a node of another body than the parent's")
        joints.append(Joint(name, parent, child, placement, tuple(axes)))
        section.done()
    return joints


def _read_axis(section: Section, whole: str, laws: ParameterLaws) -> Axis:
    name = whole.rpartition(".")[2]

    def dimension(quantity: str) -> str:
        """Return the dimension of a quantity of the axis."""
        return axis_dimension(name, quantity)

    axis = Axis(
        name=name,
        actuated=section.flag("actuated"),
        stiffness=laws.coefficient(section, "stiffness", dimension("stiffness"), whole),
        damping=laws.coefficient(section, "damping", dimension("damping"), whole),
        rotor_inertia=section.quantity("rotor_inertia", dimension("inertia"), 0.0, at_least=0.0),
        effort=section.quantity("effort", dimension("effort"), math.inf, above=0.0),
        effort_rate=section.quantity("effort_rate", dimension("effort rate"), math.inf, above=0.0),
        velocity=section.quantity("velocity", dimension("velocity"), math.inf, above=0.0),
        lower=section.quantity("lower", dimension("position"), -math.inf),
        upper=section.quantity("upper", dimension("position"), math.inf),
        guess=section.quantity("guess", dimension("position"), 0.0),
        damping_ratio=section.quantity("damping_ratio", "ratio", 0.0, at_least=0.0, below=1.0),
        backlash=section.quantity("backlash", dimension("position"), 0.0, at_least=0.0, below=MOST_PLAY),
    )
    _refuse_idle(section, axis)
    if axis.backlash and any(law.axis == whole for law in laws.found):
        raise section.error(
            "backlash", section.take("backlash"), "not where a coefficient follows a parameter"
        )
    if not axis.lower < axis.upper:
        raise section.error("upper", section.take("upper"), f"must be above lower, {section.take('lower')}")
    if section.has("guess") and not axis.lower <= axis.guess <= axis.upper:
        allowed = f"must lie within [{axis.lower:.6g}, {axis.upper:.6g}] {si_unit(dimension('position'))}"
        raise section.error("guess", section.take("guess"), allowed)
    section.done()
    return axis


def _refuse_idle(section: Section, axis: Axis) -> None:
    """Raise ConfigError where a key says what an axis of this kind does not have."""
    is_spring = bool(axis.stiffness) and not axis.actuated
    idle = [(key, f"it is {meant} of a spring: an axis with stiffness and without motor")
            for key, meant in OF_SPRINGS.items() if getattr(axis, key) and not is_spring]  # fmt: skip
    if not axis.actuated:
        idle += [
            (key, "it is of a motor: an axis with actuated: true") for key in OF_MOTORS if section.has(key)
        ]
    elif section.has("guess"):
        idle.append(("guess", "it is of an axis without motor; where motors stand, served.home says"))
    for key, whose in idle:
        raise section.error(key, section.take(key), f"has no effect; {whose}")


def refuse_idle_guesses(top: Section, joints: tuple[Joint, ...], closures: tuple[Joint, ...]) -> None:
    """Raise ConfigError where a joint that lies in no loop says where closing one starts."""
    looped, whole = joints_in_loops(joints, closures), top.section("joints")
    for joint in joints:
        axes = whole.section(joint.name).section("axes", {})
        for axis in joint.axes if joint.name not in looped else ():
            section = axes.section(axis.name)
            if section.has("guess"):
                allowed = f"has no effect; it is of an axis in a loop, and '{joint.name}' is in none"
                raise section.error("guess", section.take("guess"), allowed)


def sort_joints(
    top: Section, joints: list[Joint], bodies: dict[str, Body]
) -> tuple[tuple[Joint, ...], tuple[Joint, ...]]:
    """Return the joints that place a body, parents first, and those that close a loop.

    Of several joints to one body the first in the file whose parent is placed places it.
    """
    placed, waiting = {WORLD}, list(joints)
    ordered: list[Joint] = []
    closures: list[Joint] = []
    while waiting:
        ready = next((joint for joint in waiting if joint.parent.body in placed), None)
        if ready is None:
            raise top.error(
                f"joints.{waiting[0].name}.parent",
                str(waiting[0].parent),
                "is not connected to the world by any joint",
            )
        waiting.remove(ready)
        (closures if ready.child.body in placed else ordered).append(ready)
        placed.add(ready.child.body)
    for name in bodies:
        if name not in placed:
            raise top.error(f"bodies.{name}", name, "dangles: no joint has a node of it as child")
    return tuple(ordered), tuple(closures)
