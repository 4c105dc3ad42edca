"""The single link in EXUDYN: hub, clamped strip of ANCF cable elements, point mass, constant torque.

EXUDYN is imported when an arm is built: only those who compare need it.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Sequence
from typing import Any

from flexarm_model.manipulator.body_spec import Beam


def build(strip: Beam, inertia: float, radius: float, elements: int, torque: float) -> tuple[Any, int]:
    """Return the assembled system and the number of the sensor that stores where its tip is.

    Args:
        strip: Beam of one piece with one point mass.
        inertia: Of the hub [kg m^2].
        radius: Where the strip is clamped [m].
        elements: Number of ANCF cable elements.
        torque: On the hub [N m].
    """
    system: Any = importlib.import_module("exudyn").SystemContainer().AddSystem()
    axis, clamp = _hub(system, inertia, radius)
    tip, cables = _strip(system, strip, clamp, radius, elements)
    _point_mass(system, strip, cables, radius)
    system.AddLoad(_items().Torque(markerNumber=axis, loadVector=[0, 0, torque]))
    sensor = _sensor(system, tip)
    system.Assemble()
    return system, sensor


def solve(system: Any, step: float, duration: float, sample: float) -> float:
    """Simulate by the generalised-alpha method; returns the CPU time [s].

    Args:
        system: Of ``build``.
        step: Of the method [s].
        duration: How long [s].
        sample: The sensor stores once in so long [s].
    """
    settings = importlib.import_module("exudyn").SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = sample
    run = settings.timeIntegration
    run.endTime, run.numberOfSteps, run.verboseMode = duration, round(duration / step), 0
    run.generalizedAlpha.spectralRadius = 0.9
    run.newton.useModifiedNewton = True
    run.newton.relativeTolerance = 1e-5  # the default, 1e-8, is below its rounding here and never met
    start = time.process_time()
    system.SolveDynamic(settings)
    return time.process_time() - start


def _items() -> Any:
    return importlib.import_module("exudyn.itemInterface")


def _hub(system: Any, inertia: float, radius: float) -> tuple[int, int]:
    """Add a hub that turns about the origin; returns its markers at the axis and at the clamp."""
    item = _items()
    ground = system.AddMarker(item.MarkerBodyRigid(bodyNumber=system.AddObject(item.ObjectGround())))
    node = system.AddNode(item.NodeRigidBody2D(referenceCoordinates=[0, 0, 0]))
    hub = system.AddObject(item.ObjectRigidBody2D(mass=1e-3, inertia=inertia, nodeNumber=node))
    axis, clamp = (
        system.AddMarker(item.MarkerBodyRigid(bodyNumber=hub, localPosition=[at, 0, 0]))
        for at in (0.0, radius)
    )
    system.AddObject(item.ObjectJointRevolute2D(markerNumbers=[ground, axis]))
    return axis, clamp


def _strip(system: Any, strip: Beam, clamp: int, radius: float, elements: int) -> tuple[int, Sequence[int]]:
    """Add the strip, clamped at a marker; returns the node of its tip and its elements."""
    item, piece, h = _items(), strip.pieces[0], strip.length / elements
    nodes = [
        system.AddNode(item.NodePoint2DSlope1(referenceCoordinates=[radius + h * i, 0, 1, 0]))
        for i in range(elements + 1)
    ]
    properties = {
        "length": h,
        "massPerLength": piece.density * piece.area,
        "bendingStiffness": piece.E * piece.I_z,
        "axialStiffness": piece.E * piece.area,
    }
    cables = [
        system.AddObject(item.ObjectANCFCable2D(nodeNumbers=nodes[i : i + 2], **properties))
        for i in range(elements)
    ]
    root = system.AddMarker(item.MarkerBodyRigid(bodyNumber=cables[0], localPosition=[0, 0, 0]))
    system.AddObject(item.GenericJoint(markerNumbers=[clamp, root], constrainedAxes=[1, 1, 0, 0, 0, 1]))
    return nodes[-1], cables


def _point_mass(system: Any, strip: Beam, cables: Sequence[int], radius: float) -> None:
    """Fasten the strip's point mass to the element that carries it."""
    item, (mass,) = _items(), strip.point_masses
    h = strip.length / len(cables)
    k = min(int(mass.at / h), len(cables) - 1)
    point = system.AddNode(item.NodePoint2D(referenceCoordinates=[radius + mass.at, 0]))
    system.AddObject(item.MassPoint2D(mass=mass.mass, nodeNumber=point))
    carrier = item.MarkerBodyPosition(bodyNumber=cables[k], localPosition=[mass.at - k * h, 0, 0])
    markers = [system.AddMarker(carrier), system.AddMarker(item.MarkerNodePosition(nodeNumber=point))]
    system.AddObject(item.ObjectJointRevolute2D(markerNumbers=markers))


def _sensor(system: Any, node: int) -> int:
    """Store where a node is; returns the sensor's number."""
    position = importlib.import_module("exudyn").OutputVariableType.Position
    stored = {"outputVariableType": position, "storeInternal": True, "writeToFile": False}
    return int(system.AddSensor(_items().SensorNode(nodeNumber=node, **stored)))
