"""The manipulator as a graph: bodies joined by sets of axes, and the sensors on them.

A body is rigid, a beam of welded prismatic pieces, or imported. A joint is a set of axes out of
``tx ty tz rx ry rz`` (in this order), each free, actuated and/or sprung; without axes it is a weld.
A joint between two bodies that are placed already closes a loop.
All values are SI.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from flexarm_model.imported_body import ImportedBody, SuperelementBody

Array = NDArray[np.float64]

AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
DEFORMATIONS = ("bend_y", "bend_z", "torsion", "stretch")
WORLD = "world"


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
        guess: Where the axis stands, about, at the home pose [rad or m]; closing a loop starts there.
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
class RigidBody:
    """A rigid body.

    Attributes:
        name: Name of the body.
        mass: Mass [kg].
        com: Centre of mass in the body frame [m], (3,).
        inertia: About the centre of mass, in body axes [kg m^2], (3, 3).
        nodes: Position of every node in the body frame [m], (3,) each; "root" is the origin.
    """

    name: str
    mass: float
    com: Array
    inertia: Array
    nodes: dict[str, Array]


@dataclass(frozen=True)
class BeamPiece:
    """A prismatic length of beam along x, made of one material.

    Attributes:
        length: Length [m].
        area: Cross-section [m^2].
        I_y, I_z: Second moments about y (bending along z) and z (bending along y) [m^4].
        torsion_constant: Saint-Venant's J [m^4].
        E, G: Young's and shear modulus [Pa].
        density: Density [kg/m^3].
        elements: Number of finite elements.
        axial_rigidity: Force per stretch [N]; None is E times area.
        rigid: The piece does not deform at all (the half-body of a hinge or hub).
    """

    length: float
    area: float
    I_y: float
    I_z: float
    torsion_constant: float
    E: float
    G: float
    density: float
    elements: int
    axial_rigidity: float | None = None
    rigid: bool = False


@dataclass(frozen=True)
class PointMass:
    """A small mass on the beam's axis.

    Attributes:
        name: Name of the mass.
        at: Distance from the root [m].
        mass: Mass [kg].
        inertia: Its own, about any axis through it [kg m^2].
    """

    name: str
    at: float
    mass: float
    inertia: float = 0.0


@dataclass(frozen=True)
class Reduction:
    """How a flexible body becomes a superelement.

    Attributes:
        method: "craig_bampton" (interfaces and fixed-interface modes) or "guyan" (interfaces only).
        modes: Number of modes kept in the end; 0 keeps all static ones and what ``f_max`` says.
        frame: "clamped" (tangent at the root) or "chord" (through root and far end).
        retain: Further nodes kept as interfaces, beside those that joints use.
        interface: What an interface node keeps: "welded" its position and rotation, "pinned" its position
            only, so that the slope at a hinge is left to the modes.
        f_max: Fixed-interface modes up to here are kept beside the static ones [Hz].
    """

    method: str
    modes: int
    frame: str
    retain: tuple[str, ...] = ()
    interface: str = "welded"
    f_max: float = 0.0


@dataclass(frozen=True)
class Beam:
    """A flexible body: welded pieces along x, straight when unloaded.

    Attributes:
        name: Name of the body.
        pieces: From the root outwards.
        point_masses: On the axis.
        deformation: Subset of ``DEFORMATIONS``; the others are rigid.
        damping_ratio: Of every mode that strains this body alone [1].
        damping_time: Damping over stiffness [s], in addition.
        rotary_inertia: Whether sections resist turning as they bend (Rayleigh) or not (Euler-Bernoulli).
        nodes: Distance of every node from the root [m].
        reduction: How it is reduced.
    """

    name: str
    pieces: tuple[BeamPiece, ...]
    point_masses: tuple[PointMass, ...]
    deformation: tuple[str, ...]
    damping_ratio: float
    nodes: dict[str, float]
    reduction: Reduction
    damping_time: float = 0.0
    rotary_inertia: bool = True

    @property
    def length(self) -> float:
        """Total length [m]."""
        return sum(piece.length for piece in self.pieces)


Body: TypeAlias = RigidBody | Beam | ImportedBody | SuperelementBody


@dataclass(frozen=True)
class BiasSpec:
    """What a sensor's channels may be off by, each by itself: a constant that drifts.

    Attributes:
        sigma: One sigma when nothing has been learned yet, SI.
        drift: Random walk, growth of one sigma per square root of time, SI/sqrt(s).
        limit: Largest that is believed; what lies beyond it is a fault, SI.
        rate: One sigma of a steady drift, as warming up makes it; 0 for none, SI/s.
        rate_time: How long such a drift lasts [s].
    """

    sigma: float
    drift: float
    limit: float
    rate: float = 0.0
    rate_time: float = 60.0


@dataclass(frozen=True)
class SensorSpec:
    """A mounted sensor: what it is, where it sits, what it delivers.

    Attributes:
        name: Name of the sensor.
        kind: A key of ``sensors.SENSOR_KINDS``.
        site: Axis "joint.axis" of an encoder, node "body.node" of the others.
        channels: Names of its outputs, (m,).
        sigma: One-sigma noise of every channel, SI, (m,).
        rate_hz: Samples per second [Hz]; 0 means one per control period.
        latency: Age of a sample when it arrives [s].
        low, high: Smallest and largest value that is physically possible, SI.
        offset: Of a gauge from the beam's axis along y and z [m], (2,).
        limit: Largest strain allowed at a gauge [1].
        stamp_delay: Stamp minus instant of the sample: how late the driver stamps [s].
        bias: What its channels may be off by; None for nothing.
    """

    name: str
    kind: str
    site: str
    channels: tuple[str, ...]
    sigma: Array
    rate_hz: float = 0.0
    latency: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    offset: tuple[float, float] = (0.0, 0.0)
    limit: float = math.inf
    stamp_delay: float = 0.0
    bias: BiasSpec | None = None


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

    @property
    def axes(self) -> dict[str, Axis]:
        """All axes by their name "joint.axis": those of the tree, then those of the closures."""
        return {f"{j.name}.{a.name}": a for j in (*self.joints, *self.closures) for a in j.axes}

    @property
    def actuated(self) -> dict[str, Axis]:
        """Actuated axes by their name "joint.axis"."""
        return {name: axis for name, axis in self.axes.items() if axis.actuated}
