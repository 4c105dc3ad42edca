"""The manipulator as a graph: bodies joined by sets of axes, and the sensors on them.

A joint is a set of axes out of ``tx ty tz rx ry rz`` (in this order), each free, actuated and/or sprung;
without axes it is a weld. A joint between two bodies that are placed already closes a loop.
All values are SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.body_spec import Body
from flexarm_model.manipulator.parameter_law import AxisLaw
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]

AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
WORLD = "world"
_RUN_OVER = 0.1  # s at full speed past an end of the range: twice what a guard waits before it stops an arm


@dataclass(frozen=True)
class NodeRef:
    """A node of a body, written ``body.node`` in the YAML."""

    body: str
    node: str

    def __str__(self) -> str:
        """Return the YAML form."""
        return f"{self.body}.{self.node}"


@dataclass(frozen=True)
class Axis:
    """One axis of a joint.

    Attributes:
        name: One of ``AXES``.
        actuated: A motor drives it.
        stiffness, damping: Spring about zero [N m/rad or N/m] and damper [N m s/rad or N s/m]; 0 means none.
        rotor_inertia: Motor and gear seen at the joint [kg m^2 or kg].
        effort, effort_rate: Largest torque or force [N m or N], and its largest rate [N m/s or N/s].
        velocity: Largest velocity [rad/s or m/s].
        lower, upper: Lowest and highest position [rad or m].
        damping_ratio: Of every mode that strains this spring alone [1].
        guess: Where the axis stands, about, at the home pose [rad or m]; closing its loop starts there.
        backlash: Total play of this spring [rad or m], half of it on either side of zero; there it bears
            nothing in the simulated rig. Models of the arm take the gear as engaged: as if there were none.
    """

    name: str
    actuated: bool = False
    stiffness: float = 0.0
    damping: float = 0.0
    rotor_inertia: float = 0.0
    effort: float = math.inf
    effort_rate: float = math.inf
    velocity: float = math.inf
    lower: float = -math.inf
    upper: float = math.inf
    guess: float = 0.0
    damping_ratio: float = 0.0
    backlash: float = 0.0

    @property
    def possible(self) -> tuple[float, float]:
        """Lowest and highest position that the axis can have at all, a little beyond its range [rad or m].

        Without a limit of its velocity it may be as far beyond as the range is wide.
        """
        beyond = min(_RUN_OVER * self.velocity, self.upper - self.lower)
        return self.lower - beyond, self.upper + beyond


@dataclass(frozen=True)
class Joint:
    """Axes between a node of the parent and a node of the child.

    Attributes:
        name: Name of the joint.
        parent, child: Node on the parent (body "world" is the base) and node on the child.
        placement: Pose of the joint in the parent node's frame, (4, 4).
        axes: In the order of ``AXES``; empty for a weld.
    """

    name: str
    parent: NodeRef
    child: NodeRef
    placement: Array
    axes: tuple[Axis, ...]


@dataclass(frozen=True)
class ManipulatorConfig:
    """The whole description, as ``load_config`` returns it.

    Attributes:
        name, source: Name of the manipulator, and where its numbers come from.
        preset: Preset applied; "" for none.
        config_id: Content hash of the description with the preset applied.
        gravity: In the world frame [m/s^2], (3,).
        bodies: By name.
        joints: Those that place a body, sorted so that a parent is placed before its child.
        closures: Those between two bodies that are placed already; each closes a loop.
        sensors: In the order of the file.
        tip: The tool point.
        modes: Number of elastic modes served.
        home: Actuated axes at the home pose [rad or m], (n_theta,).
        rate_hz: Control rate [Hz].
        poses: Further poses by name, as ``home``.
        parameters: Named parameters that laws of axes follow, by name, SI.
        laws: The coefficients of axes that follow them.
        damped_at: Where damping ratios hold, the described home, if the arm starts elsewhere; else None.
        assumed, fitted: What no source gives; what was fitted, and on what.
    """

    name: str
    source: str
    preset: str
    config_id: str
    gravity: Array
    bodies: dict[str, Body]
    joints: tuple[Joint, ...]
    sensors: tuple[SensorSpec, ...]
    tip: NodeRef
    modes: int
    home: Array
    rate_hz: float
    assumed: tuple[str, ...] = ()
    fitted: tuple[str, ...] = ()
    closures: tuple[Joint, ...] = ()
    poses: dict[str, Array] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)
    laws: tuple[AxisLaw, ...] = ()
    damped_at: Array | None = None

    @property
    def axes(self) -> dict[str, Axis]:
        """All axes by their name "joint.axis": those of the tree, then those of the closures."""
        return {f"{j.name}.{a.name}": a for j in (*self.joints, *self.closures) for a in j.axes}

    @property
    def damping_pose(self) -> Array:
        """Actuated axes at the pose where damping ratios hold [rad or m], (n_theta,)."""
        return self.home if self.damped_at is None else self.damped_at

    @property
    def actuated(self) -> dict[str, Axis]:
        """Actuated axes by their name "joint.axis"."""
        return {name: axis for name, axis in self.axes.items() if axis.actuated}
