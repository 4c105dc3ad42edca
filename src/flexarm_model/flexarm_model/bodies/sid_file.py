"""Superelements in text files that other multibody programs read and write: standard input data.

``write_sid`` writes the standard matrices (``sid_terms``) in the standard grammar (``sid_text``), all in SI,
and behind them a block ``flexarm`` with what the standard does not hold. ``read_sid`` gives back a written
superelement bit for bit; from a file without that block it makes the one that the matrices stand for.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.sid_terms import ORDERED, sid_integrals, sid_matrices
from flexarm_model.bodies.sid_text import Block, Taylor, format_array, format_taylor, parse_blocks
from flexarm_model.bodies.superelement import NodeShape, Superelement
from flexarm_model.numeric.dense import eigh
from flexarm_model.numeric.rotation import skew
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]

_OWN = "flexarm"
_VERSION = 2
_READ = (1, 2)  # the first holds no damping ratio: there De is all that is known of the damping


def write_sid(body: Superelement, path: Path) -> None:
    """Write a superelement."""
    part = list(_part(body))
    path.write_text("\n".join([*part, *_own(body, _hash(part))]) + "\n", encoding="utf-8")


def read_sid(path: Path) -> Superelement:
    """Read a superelement.

    Raises:
        ConfigError: The file cannot be read or is not such a file; names file, line and what is allowed.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text") from None
    file = parse_blocks(path, lines)
    modal = file.block("part").block("modal")
    own = file.find(_OWN)
    if own is not None:
        _check_own(own, lines)
    refmod = modal.block("refmod")
    n = int(refmod.number("nelastq"))
    matrices = {name: modal.block(name).taylor(n) for name in ORDERED if name != "ksigma"}
    _check_shapes(modal, matrices, n)
    nodes = {block.label: _read_node(block, n) for block in modal.block("frame").blocks}
    s, P = sid_integrals(matrices)
    K, D = matrices["Ke"].m0, matrices["De"].m0
    if own is None:
        omega = np.sqrt(np.maximum(eigh(K, matrices["Me"].m0)[0], 0.0)) if n else np.zeros(0)
        return Superelement(path.stem, refmod.number("mass"), s, P, omega, K, D, nodes)
    n_f = int(own.number("fields"))
    strain = own.array("strain", (len(nodes), 3, n))
    nodes = {
        name: NodeShape(node.r, node.Phi, node.Psi, node.G, strain[k])
        for k, (name, node) in enumerate(nodes.items())
    }
    omega, P = own.array("omega", (n,)), own.array("P", (n_f, n_f, 3, 3))
    ratio = 0.0
    if own.number("version") > 1:
        ratio, D = own.number("damping_ratio"), own.array("D", (n, n))
    return Superelement(own.values["name"], refmod.number("mass"), s[:n_f], P, omega, K, D, nodes, ratio)


def _part(body: Superelement) -> Iterator[str]:
    """Yield the lines that every program knows."""
    n = body.n
    yield from ("part", "new modal", "refmod", f"mass = {body.mass!r}", f"nelastq = {n}")
    yield from (
        f"ielastq({i + 1:2d}) = mode {i + 1}: {f:.6g} Hz" for i, f in enumerate(body.omega / (2 * np.pi))
    )
    yield from ("end refmod", "frame")
    for name, node in body.nodes.items():
        yield from (f"new node = {name}", "rframe = body ref")
        for key, matrix in _node_matrices(node).items():
            yield from format_taylor(key, matrix, n)
        yield "end node"
    yield "end frame"
    for key, matrix in sid_matrices(body).items():
        yield from format_taylor(key, matrix, n)
    yield from ("end modal", "end part")


def _own(body: Superelement, digest: str) -> Iterator[str]:
    """Yield the lines of what only flexarm knows."""
    strain = np.array([node.strain for node in body.nodes.values()]).reshape(len(body.nodes), 3, body.n)
    yield from (_OWN, f"version = {_VERSION}", f"digest = {digest}", f"name = {body.name}")
    yield f"fields = {body.s.shape[0]}"
    yield f"damping_ratio = {float(body.damping_ratio)!r}"
    yield from format_array("D", body.D)
    yield from format_array("omega", body.omega)
    yield from format_array("P", body.P)
    yield from format_array("strain", strain)
    yield f"end {_OWN}"


def _node_matrices(node: NodeShape) -> dict[str, Taylor]:
    """Return position, translation, rotation and orientation of a node over the coordinates."""
    turns = (
        np.stack([skew(column) for column in node.Psi.T], axis=2) if node.Psi.size else np.zeros((3, 3, 0))
    )
    return {
        "origin": Taylor(node.r[:, None], node.Phi[:, None]),
        "phi": Taylor(node.Phi, node.G if node.G.any() else None),
        "psi": Taylor(node.Psi),
        "AP": Taylor(np.eye(3), turns),
    }


def _read_node(block: Block, n: int) -> NodeShape:
    origin, phi, psi, AP = (block.block(name).taylor(n) for name in ("origin", "phi", "psi", "AP"))
    if not np.array_equal(AP.m0, np.eye(3)):
        raise block.error("AP: the node's axes must be those of the body")
    G = np.zeros((3, n, n)) if phi.m1 is None else phi.m1
    return NodeShape(origin.m0[:, 0], phi.m0, psi.m0, G, np.full((3, n), np.nan))


def _check_shapes(modal: Block, matrices: dict[str, Taylor], n: int) -> None:
    shapes = {
        "mdCM": (3, 1), "J": (3, 3), "Ct": (n, 3), "Cr": (n, 3), "Me": (n, n), "Gr": (3, 3 * n),
        "Ge": (n, 3 * n), "Oe": (n, 6), "Ke": (n, n), "De": (n, n),
    }  # fmt: skip
    for name, shape in shapes.items():
        if matrices[name].m0.shape != shape:
            found = matrices[name].m0.shape
            raise modal.block(name).error(f"is {found[0]} x {found[1]}; expected {shape[0]} x {shape[1]}")


def _check_own(own: Block, lines: list[str]) -> None:
    if own.number("version") not in _READ:
        raise own.error(f"version {own.values['version']}: expected one of {', '.join(map(str, _READ))}")
    if own.values.get("digest") != _hash(lines[: own.line - 1]):
        raise own.error(f"the part before was changed; remove the block '{_OWN}' or write the file anew")


def _hash(lines: list[str]) -> str:
    return hashlib.sha256("\n".join(line.strip() for line in lines).encode()).hexdigest()[:16]
