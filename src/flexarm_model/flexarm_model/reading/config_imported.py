"""Bodies of ``type: imported`` and ``type: superelement`` in a YAML; their files lie relative to the YAML.

Coordinates and node sets are read here, so that the positions of nodes are part of the description; the
matrices are read when the body is reduced. The identity of the description holds the hash of all files.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.sid_file import read_sid
from flexarm_model.fe_import.mesh_files import read_nodes, read_set
from flexarm_model.fe_import.row_order import read_rows
from flexarm_model.manipulator.imported_body import (
    INTERFACE_KINDS,
    FileUnits,
    ImportedBody,
    ImportedReduction,
    MatrixFile,
    NodeSet,
    SuperelementBody,
)
from flexarm_model.numeric.rotation import rotation_from_rpy
from flexarm_model.reading.config_damping import Damping, read_damping
from flexarm_model.settings.strict_yaml import ConfigError, Section
from flexarm_model.settings.units import UNITS

Array = NDArray[np.float64]

METHODS = ("craig_bampton", "guyan")


def read_imported(name: str, section: Section) -> ImportedBody:
    """Read an imported body.

    Raises:
        ConfigError: A value or a file is wrong; names both.
    """
    units = _read_units(section.section("units"))
    path = _path(section, "nodes")
    try:
        labels, x = read_nodes(path)
    except ConfigError as error:
        raise section.error("nodes", section.text("nodes"), str(error)) from None
    R = rotation_from_rpy(section.quantities("orientation", ["angle"] * 3, (0.0, 0.0, 0.0)))
    sets, points, files = {}, {}, [path]
    for node, inner in section.sections("interfaces"):
        files.append(_path(inner, "set"))
        sets[node], points[node] = _read_interface(inner, labels, x * units.length)
    if "root" not in sets:
        raise section.error("interfaces", list(sets), "must hold 'root', where the body's frame is")
    damping = _read_matrix_file(section, "damping") if section.has("damping") else None
    said = Damping(0.0, 0.0, 0.0) if damping else read_damping(section)
    matrices = [_read_matrix_file(section, "mass"), _read_matrix_file(section, "stiffness")]
    rows = _read_rows(section, labels, files) if section.has("rows") else None
    files += [item.path for item in (*matrices, damping) if item is not None]
    return ImportedBody(
        name=name,
        mass=matrices[0],
        stiffness=matrices[1],
        damping=damping,
        units=units,
        orientation=R,
        x=(x * units.length - points["root"]) @ R.T,
        sets=sets,
        nodes={node: R @ (point - points["root"]) for node, point in points.items()},
        damping_ratio=said.ratio,
        reduction=_read_reduction(section.section("reduction"), tuple(sets)),
        digest=_digest(section, files),
        damping_time=said.time,
        damping_rate=said.rate,
        rows=rows,
        labels=labels,
    )


def read_superelement(name: str, section: Section) -> SuperelementBody:
    """Read a body that is reduced already.

    Raises:
        ConfigError: A value or the file is wrong; names both.
    """
    path = _path(section, "file")
    try:
        shapes = read_sid(path).nodes
    except ConfigError as error:
        raise section.error("file", section.text("file"), str(error)) from None
    nodes, strain = ({node: getattr(shapes[node], item) for node in shapes} for item in ("r", "strain"))
    return SuperelementBody(name, path, nodes, strain, _digest(section, [path]))


def _read_rows(section: Section, labels: NDArray[np.intp], files: list[Path]) -> NDArray[np.intp]:
    """Return what stands in which row of the matrices, and add the file that says it."""
    files.append(_path(section, "rows"))
    try:
        return read_rows(files[-1], labels)
    except ConfigError as error:
        raise section.error("rows", section.text("rows"), str(error)) from None


def _read_units(section: Section) -> FileUnits:
    length = UNITS["length"][section.choice("length", tuple(UNITS["length"]))]
    mass = UNITS["mass"][section.choice("mass", tuple(UNITS["mass"]))]
    time = UNITS["time"][section.choice("time", tuple(UNITS["time"]), "s")]
    section.done()
    return FileUnits(length, mass, time)


def _read_interface(section: Section, labels: NDArray[np.intp], x: Array) -> tuple[NodeSet, Array]:
    """Return the set and the position of its node in the files' axes [m], (3,)."""
    try:
        index, weight = read_set(_path(section, "set"), labels)
    except ConfigError as error:
        raise section.error("set", section.text("set"), str(error)) from None
    middle = np.average(x[index], axis=0, weights=weight)
    at = section.quantities("at", ["length"] * 3, middle.tolist())
    away, size = float(np.linalg.norm(at - middle)), float(np.linalg.norm(np.ptp(x, axis=0)))
    if section.has("at") and away > size:
        far = f"lies {away:.3g} m from the middle of its nodes, farther than the body is large ({size:.3g} m)"
        allowed = f"{far}; expected a point near them, in the files' axes, and the files in the units given"
        raise section.error("at", section.take("at"), allowed)
    nodes = NodeSet(section.choice("kind", INTERFACE_KINDS), index, weight)
    section.done()
    return nodes, at


def _read_matrix_file(section: Section, key: str) -> MatrixFile:
    inner = section.section(key)
    file = MatrixFile(_path(inner, "file"), inner.text("variable", ""))
    inner.done()
    return file


def _read_reduction(section: Section, nodes: tuple[str, ...]) -> ImportedReduction:
    method = section.choice("method", METHODS)
    f_max = section.quantity("f_max", "frequency", above=0.0) if section.has("f_max") else 0.0
    modes = section.count("modes") if section.has("modes") else 0
    if bool(f_max) + bool(modes) != 1 and method != "guyan":
        raise section.error("modes", modes, "expected either modes or f_max")
    if f_max and method == "guyan":
        raise section.error("f_max", f_max, "Guyan reduction has static modes only; leave f_max out")
    reduction = ImportedReduction(method, modes, f_max, section.choices("retain", nodes, ()))
    section.done()
    return reduction


def _path(section: Section, key: str) -> Path:
    return Path(section.path).parent / section.text(key)


def _digest(section: Section, files: list[Path]) -> str:
    digest = hashlib.sha256()
    for path in files:
        try:
            digest.update(hashlib.sha256(path.read_bytes()).digest())
        except OSError as error:
            raise section.error("", str(path), f"cannot be read ({error.strerror})") from None
    return digest.hexdigest()
