"""Seed 003: where links ring with their interfaces held: what Craig-Bampton keeps and Guyan leaves out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_data import robot
from flexarm_bringup.reproduce.seed_003_golden import locked_hz
from flexarm_model.bodies.model_order import FULL, with_modes_below
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import WORLD, Joint, NodeRef
from flexarm_model.served.linear_assembly import assemble

Array = NDArray[np.float64]

TOP_HZ = 1500.0
NOTES = {  # Hz; seed 003, section 3
    "bracket": "295, 295, 721, 1270",
    "tail": "295, 295, 721, 1270",
    "lower_arm": "1343",
    "forearm": "1057, 1057",
}


def link_table() -> tuple[Table, list[Check]]:
    """Return the fixed-interface modes below 1.5 kHz of every beam."""
    beams = [name for name, body in robot().bodies.items() if isinstance(body, Beam)]
    rows: list[Cells] = []
    for name in beams:
        f = fixed_interface_hz(name)
        ours = ", ".join(f"{value:.0f}" for value in f[f < TOP_HZ])
        rows.append([name, NOTES.get(name, "none"), ours or "none"])
    turning, by_constant = torsion_hz("bracket")
    notes = [
        "Bracket and tail are part of links 1 and 3; nothing stands on their tips, so that is free.",
        f"Their third mode is torsion: {turning:.0f} Hz. The notes' 721 comes out when sections resist "
        f"turning by density × torsion constant ({by_constant:.0f}) and not by density × polar moment.",
    ]
    columns = (Column("beam"), Column("notes [Hz]"), Column("ours [Hz]"))
    return Table("Modes of the links below 1.5 kHz with their interfaces held", columns, rows, notes), []


def torsion_hz(name: str) -> tuple[float, float]:
    """Return the first torsional frequency of a cantilever with masses at its tip [Hz], by a linear twist.

    Its sections' inertia per length is density times the polar moment, or times the torsion constant instead.
    """
    beam = robot().bodies[name]
    assert isinstance(beam, Beam)
    piece = next(piece for piece in beam.pieces if not piece.rigid)
    stiffness = piece.G * piece.torsion_constant / piece.length
    tip = sum(mass.inertia for mass in beam.point_masses)
    turning, by_constant = (
        float(np.sqrt(stiffness / (tip + piece.density * moment * piece.length / 3)) / (2 * np.pi))
        for moment in (piece.I_y + piece.I_z, piece.torsion_constant)
    )
    return turning, by_constant


def fixed_interface_hz(name: str) -> Array:
    """Return the frequencies of a beam welded to the world at every interface [Hz]."""
    beam = robot().bodies[name]
    assert isinstance(beam, Beam)
    foot = Joint("foot", NodeRef(WORLD, "root"), NodeRef(name, "root"), np.eye(4), ())
    at_end = np.eye(4)
    at_end[0, 3] = beam.nodes.get("end", 0.0)
    head = Joint("head", NodeRef(WORLD, "root"), NodeRef(name, "end"), at_end, ())
    held = (head,) if "end" in beam.nodes else ()
    config = replace(
        robot(), bodies={name: beam}, joints=(foot,), closures=held, sensors=(), home=np.zeros(0)
    )
    return locked_hz(assemble(with_modes_below(config, FULL)))
