"""The plots of the page of seed 003: matrix of responses, deviation over frequency, modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_bringup.model_view.mechanism_figure import Shape, modes_figure
from flexarm_bringup.model_view.mechanism_lines import Line, all_points
from flexarm_bringup.page.figures import COLOURS, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_003_data import (
    HIGH_HZ,
    at_pose,
    model_at,
    motor_frf,
    responses,
    robot,
)
from flexarm_bringup.reproduce.seed_003_orders import TOP_HZ
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linear_assembly import LinearAssembly

Array = NDArray[np.float64]

SHOWN = {"cb_1000": "CB-1000", "lumped": "lumped, datasheet", "rigid": "rigid, gear springs"}
CURVES = {"guyan": "Guyan", "cb_500": "CB-500", "cb_1000": "CB-1000", "lumped": "lumped", "rigid": "rigid"}
LINES_HZ = np.geomspace(4.0, HIGH_HZ, 240)  # dense: resonances are narrow
SAMPLES = 9  # points along a beam
SHARE = 0.12  # of the robot's size: largest displacement drawn
DRAWN_MODES = 6


def all_figures() -> list[Figure]:
    """Return the three figures."""
    return [frf_figure(), deviation_figure(), mode_figure()]


def frf_figure() -> Figure:
    """Return the 6 x 6 matrix of responses at mid in dB."""
    frfs = {name: motor_frf(model_at(name, "mid"), LINES_HZ).db() for name in SHOWN}
    with drawing(9.0, 8.2) as plot:
        axes = plot.subplots(6, 6, sharex=True, sharey=True)
        for (name, title), colour in zip(SHOWN.items(), COLOURS, strict=False):
            for i, j in np.ndindex(6, 6):
                axes[i, j].semilogx(LINES_HZ, frfs[name][:, i, j], color=colour, linewidth=0.8, label=title)
        for i in range(6):
            axes[i, 0].set_ylabel(f"motor {i + 1}")
            axes[0, i].set_title(f"torque {i + 1}")
            axes[5, i].set_xlabel("f [Hz]")
        axes[0, 0].set_ylim(-140, 20)
        plot.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(SHOWN))
        return to_figure(
            plot,
            "Motor acceleration per motor torque at mid, output side, dB of 1 (rad/s²)/(N·m).",
        )


def deviation_figure() -> Figure:
    """Return the deviation from the full model over frequency at mid."""
    full = responses("full", "mid", TOP_HZ)
    with drawing(9.0, 3.6) as plot:
        axis = plot.subplots()
        for name, title in CURVES.items():
            off = abs(responses(name, "mid", TOP_HZ).db() - full.db()).mean(axis=(1, 2))
            axis.loglog(full.f_hz, np.maximum(off, 1e-4), label=title, linewidth=1.2)
        for edge in (HIGH_HZ, 300.0):
            axis.axvline(edge, color=COLOURS[5], linewidth=0.8, linestyle=":")
        axis.set(xlabel="f [Hz]", ylabel="mean |deviation| [dB]", ylim=(1e-4, 60))
        plot.legend(loc="outside upper center", ncols=len(CURVES))
        return to_figure(
            plot,
            "Deviation from the full model, mean of 36 curves, at mid. "
            "Where reductions part is decided by the bracket and tail of the assumed robot.",
        )


def mode_figure() -> Figure:
    """Return the slowest modes with the motors held, drawn on the robot at mid."""
    model = at_pose(_sampled(robot()), "mid")
    M, _, K = model.locked()
    value, vectors = eigh(K, M)
    passive = ~model.B.any(axis=1)
    shapes, titles = [], []
    for r in range(DRAWN_MODES):
        x = np.zeros(model.n)
        x[passive] = vectors[:, r]
        shapes.append(_shape(model, x))
        titles.append(f"{np.sqrt(value[r]) / (2 * np.pi):.1f} Hz")
    return modes_figure(shapes, titles, "The slowest modes at mid with the motors held (Guyan model).")


def _sampled(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return the robot with nodes along its beams."""
    bodies = {
        name: replace(body, nodes={**body.nodes, **_stations(body)}) if isinstance(body, Beam) else body
        for name, body in config.bodies.items()
    }
    return replace(config, bodies=dict(bodies))


def _stations(beam: Beam) -> dict[str, float]:
    return {f"at {i}": float(x) for i, x in enumerate(np.linspace(0.0, beam.length, SAMPLES))}


def _shape(model: LinearAssembly, x: Array) -> Shape:
    """Return the robot at rest and moved along ``x`` (n,) to both sides."""
    beams = {name: body for name, body in robot().bodies.items() if isinstance(body, Beam)}
    rest, moved = [], []
    for name, beam in beams.items():
        frame = model.places[name]
        along = np.array(list(_stations(beam).values()))[:, None] * frame.R[:, 0] + frame.p
        by = np.array([model.node_rows(f"{name}.{node}")[:3] @ x for node in _stations(beam)])
        rest.append(Line(name, along))
        moved.append(by)
    size = float(np.ptp(all_points(rest), axis=0).max())
    scale = SHARE * size / float(np.linalg.norm(np.concatenate(moved), axis=1).max())
    there, back = (
        [Line(line.body, line.points + side * scale * by) for line, by in zip(rest, moved, strict=True)]
        for side in (1.0, -1.0)
    )
    return Shape(rest, there, back, scale, np.array([model.places[name].p for name in beams]))
