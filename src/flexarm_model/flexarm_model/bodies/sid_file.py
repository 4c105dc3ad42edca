"""Superelements in text files that other multibody programs read and write: standard input data.

``write_sid`` writes the standard matrices (``sid_terms``) in the standard grammar (``sid_text``), all in SI,
and behind them a block ``flexarm`` with what the standard does not hold. ``read_sid`` gives back a written
superelement bit for bit; from a file without that block it makes the one that the matrices stand for.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from flexarm_model.bodies.sid_checks import check_matrices, check_own, matrix_shapes, own_frequencies
from flexarm_model.bodies.sid_mass import check_energy
from flexarm_model.bodies.sid_taylor import Taylor, format_taylor, read_taylor
from flexarm_model.bodies.sid_terms import sid_integrals, sid_matrices
from flexarm_model.bodies.sid_text import Block, format_array, format_text, parse_blocks
from flexarm_model.bodies.sid_twice import check_node_said_twice, check_said_twice
from flexarm_model.bodies.superelement import NodeShape, Superelement, pairs
from flexarm_model.numeric.rotation import skew
from flexarm_model.settings.strict_yaml import ConfigError

_OWN = "flexarm"
_VERSION = 4  # those before hold no damping over mass
_WHOLE = 3  # from here on the digest is of the whole file, before of the part that every program knows
_READ = (1, 2, 3, 4)  # the first holds no damping ratio: there De is all that is known of the damping
_MOST = 1000  # coordinates


def write_sid(body: Superelement, path: Path | str) -> None:
    """Write a superelement into a file of a folder that is there.

    Raises:
        OSError: The file cannot be written.
        ConfigError: A name cannot be written.
    """
    lines = [*_part(body), *_own(body)]
    lines += [f"digest = {_hash(lines)}", f"end {_OWN}"]
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_sid(path: Path | str) -> Superelement:
    """Read a superelement.

    Raises:
        ConfigError: The file cannot be read or is not such a file; names file, line and what is allowed.
    """
    path = Path(path)
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
        _check_digest(own, lines)
    n = modal.block("refmod").whole_number("nelastq", range(_MOST + 1))
    matrices = {name: read_taylor(modal.block(name), n, shape) for name, shape in matrix_shapes(n).items()}
    check_matrices(modal, matrices)
    nodes = {block.label: _read_node(block, n) for block in modal.block("frame").blocks}
    if own is None:
        body = _make_body(path.stem, modal, matrices, nodes)
    else:
        body = _read_own(own, modal, matrices, nodes)
        check_own(own, modal, matrices, body)
    check_energy(modal, matrices)
    check_said_twice(modal, matrices, body)
    return body


def _make_body(
    name: str, modal: Block, matrices: dict[str, Taylor], nodes: dict[str, NodeShape]
) -> Superelement:
    """Return the superelement that the matrices alone stand for."""
    s, P = sid_integrals(matrices)
    omega, mass = own_frequencies(modal, matrices), modal.block("refmod").number("mass")
    return Superelement(name, mass, s, P, omega, matrices["Ke"].m0, matrices["De"].m0, nodes)


def _read_own(
    own: Block, modal: Block, matrices: dict[str, Taylor], nodes: dict[str, NodeShape]
) -> Superelement:
    """Return the superelement that our own block completes."""
    n = matrices["Me"].m0.shape[0]
    n_f = own.whole_number("fields", range(n + 1, n + 2 + len(pairs(n))))
    strain = own.array("strain", (len(nodes), 3, n), may_be_unknown=True)
    nodes = {name: replace(node, strain=strain[k]) for k, (name, node) in enumerate(nodes.items())}
    omega, P = own.array("omega", (n,)), own.array("P", (n_f, n_f, 3, 3))
    s, mass, K = sid_integrals(matrices)[0][:n_f], modal.block("refmod").number("mass"), matrices["Ke"].m0
    version, ratio, rate, D = own.number("version"), 0.0, 0.0, matrices["De"].m0
    if version > 1:
        ratio, D = own.number("damping_ratio"), own.array("D", (n, n))
    if version >= _VERSION:
        rate = own.number("damping_rate")
    return Superelement(own.text("name"), mass, s, P, omega, K, D, nodes, ratio, rate)


def _part(body: Superelement) -> Iterator[str]:
    """Yield the lines that every program knows."""
    n = body.n
    yield from ("part", "new modal", "refmod", f"mass = {float(body.mass)!r}", f"nelastq = {n}")
    yield from (
        f"ielastq({i + 1:2d}) = mode {i + 1}: {f:.6g} Hz" for i, f in enumerate(body.omega / (2 * np.pi))
    )
    yield from ("end refmod", "frame")
    for name, node in body.nodes.items():
        yield from (f"new node = {format_text(name)}", "rframe = body ref")
        for key, matrix in _node_matrices(node).items():
            yield from format_taylor(key, matrix, n)
        yield "end node"
    yield "end frame"
    for key, matrix in sid_matrices(body).items():
        yield from format_taylor(key, matrix, n)
    yield from ("end modal", "end part")


def _own(body: Superelement) -> Iterator[str]:
    """Yield the lines of what only flexarm knows, without their end."""
    strain = np.array([node.strain for node in body.nodes.values()]).reshape(len(body.nodes), 3, body.n)
    yield from (_OWN, f"version = {_VERSION}", f"name = {format_text(body.name)}")
    yield f"fields = {body.s.shape[0]}"
    yield f"damping_ratio = {float(body.damping_ratio)!r}"
    yield f"damping_rate = {float(body.damping_rate)!r}"
    yield from format_array("D", body.D)
    yield from format_array("omega", body.omega)
    yield from format_array("P", body.P)
    yield from format_array("strain", strain)


def _node_matrices(node: NodeShape) -> dict[str, Taylor]:
    """Return position, translation, rotation and orientation of a node over the coordinates."""
    turns = (
        np.stack([skew(column) for column in node.Psi.T], axis=2) if node.Psi.size else np.zeros((3, 3, 0))
    )
    return {
        "origin": Taylor(node.r[:, None], node.Phi[:, None]),
        "phi": Taylor(node.Phi, node.G if node.G.any() else None),
        "psi": Taylor(node.Psi, node.H if node.H.any() else None),
        "AP": Taylor(np.eye(3), turns),
    }


def _read_node(block: Block, n: int) -> NodeShape:
    if not block.label:
        raise block.error("has no name; expected 'new node = <name>'")
    shapes = {"origin": (3, 1), "phi": (3, n), "psi": (3, n), "AP": (3, 3)}
    given = {name: read_taylor(block.block(name), n, shape) for name, shape in shapes.items()}
    phi, psi = given["phi"], given["psi"]
    if not np.array_equal(given["AP"].m0, np.eye(3)):
        raise block.error("AP: the node's axes must be those of the body")
    G, H = (np.zeros((3, n, n)) if part.m1 is None else part.m1 for part in (phi, psi))
    node = NodeShape(given["origin"].m0[:, 0], phi.m0, psi.m0, G, H, np.full((3, n), np.nan))
    check_node_said_twice(block, given, _node_matrices(node))
    return node


def _check_digest(own: Block, lines: list[str]) -> None:
    version = own.whole_number("version", range(_READ[0], _READ[-1] + 1))
    hashed = lines if version >= _WHOLE else lines[: own.line - 1]
    if own.values.get("digest") != _hash(hashed):
        where = "the file" if version >= _WHOLE else "the part before"
        raise own.error(f"{where} was changed; remove the block '{_OWN}' or write the file anew")


def _hash(lines: list[str]) -> str:
    """Return the hash of lines, but for the one that holds it and the last."""
    told = (line.strip() for line in lines)
    known = "\n".join(line for line in told if not line.startswith("digest =") and line != f"end {_OWN}")
    return hashlib.sha256(known.encode()).hexdigest()[:16]
