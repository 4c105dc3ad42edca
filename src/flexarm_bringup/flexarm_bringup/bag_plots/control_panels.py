"""Panels of what the controller did: who spoke, how long it took, which vibration is left."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bag_plots.panel import line, name_rows, stacked, strip
from flexarm_bringup.bag_plots.series import BagSeries, constant_names
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_controller.debug import vibration_energy
from flexarm_model.served.reduced_model import Outputs, ReducedModel

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

Array = NDArray[np.float64]
MICRO = 1e6
LEAST_ENERGY = 1e-12  # J; below it nothing vibrates
PARTS = {"update_time": "update", "solve_time": "solve", "check_time": "check"}
NOTICES = ("reference ", "model ")  # how such a reason begins
LIMITS = 8  # kinds of limits that are shown


def draw_rungs(plot: Plot, series: BagSeries) -> None:
    """Draw the rung of the ladder, the guard and the estimator as coloured strips."""
    rows = [("controller_status", "controller", "mode"), ("guard_status", "guard", "mode")]
    rows = [row for row in [*rows, ("modal_state", "estimator", "status")] if series.has(row[0])]
    for axes, (topic, name, field) in zip(stacked(plot, len(rows)), rows, strict=True):
        messages, colours = series.messages(topic), dict[str, str]()
        words = constant_names(messages[0])
        kept = [i for i, msg in enumerate(messages) if not is_notice(msg)]
        said = [words.get(getattr(messages[i], field), "?") for i in kept]
        strip(axes, 0, series.times(topic)[kept], said, colours)
        name_rows(axes, [name], colours)


def is_notice(msg: Any) -> bool:
    """Tell whether a status only tells of a reference or a model, and not of a cycle."""
    return str(getattr(msg, "reason", "")).startswith(NOTICES)


def draw_times(plot: Plot, series: BagSeries) -> None:
    """Draw the CPU time of the controller's steps, split where it is known, and the iterations."""
    top, bottom = plot.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    cycles = [i for i, msg in enumerate(series.messages("controller_status")) if not is_notice(msg)]
    t, whole = (part[cycles] for part in (series.times("controller_status"), _status(series, "solve_time")))
    line(top, t, MICRO * whole, label="whole step")
    if series.has("controller_debug"):
        for field, name in PARTS.items():
            part = series.column("controller_debug", attrgetter(field))
            line(top, series.times("controller_debug"), MICRO * part, label=name, linewidth=0.9)
    is_timed = whole.size and whole.max() > 0.0  # a bag played again tells no times
    top.set(ylabel="CPU time [µs]", yscale="log" if is_timed else "linear")
    top.legend(fontsize=8, ncols=4)
    line(bottom, t, _status(series, "iterations")[cycles])
    bottom.set(xlabel="time [s]", ylabel="iterations [1]")


def _status(series: BagSeries, field: str) -> Array:
    return series.column("controller_status", attrgetter(field))


def draw_limits(plot: Plot, series: BagSeries) -> None:
    """Draw when which limit of the program bound."""
    axes, t = plot.subplots(), series.times("controller_status")
    messages = series.messages("controller_status")
    names = sorted({name for msg in messages for name in msg.limits_active})[:LIMITS]
    if not names:
        axes.set_axis_off()
        axes.text(0.5, 0.5, f"No limit bound, from {t[0]:.4g} to {t[-1]:.4g} s.", ha="center")
        return
    colours: dict[str, str] = {}
    for row, name in enumerate(names):
        strip(axes, row, t, ["binds" if name in msg.limits_active else "free" for msg in messages], colours)
    name_rows(axes, names, colours)
    axes.set(xlabel="time [s]", xlim=(t[0], t[-1] + 1e-9))


def draw_energy(plot: Plot, series: BagSeries) -> None:
    """Draw the energy of the modes' vibration, and what was expected one plan earlier."""
    axes = plot.subplots()
    names = series.messages("modal_state")[0].names
    t, energy = estimated_energy(series)
    for i, name in enumerate(names):
        line(axes, t, np.maximum(energy[:, i], LEAST_ENERGY), label=name)
    if series.has("controller_debug"):
        line(axes, *_expected(series), label="expected of all, a plan ahead", linestyle="--", linewidth=0.9)
    axes.set(xlabel="time [s]", ylabel="vibration [J]", yscale="log")
    axes.legend(fontsize=8, ncols=4)


def _expected(series: BagSeries) -> tuple[Array, Array]:
    """Return when plans end, and the vibration expected then [J], (k,) each."""
    pairs = zip(series.times("controller_debug"), series.messages("controller_debug"), strict=True)
    ends = [
        (t + msg.period * (len(msg.modal_energy) - 1), max(msg.modal_energy[-1], LEAST_ENERGY))
        for t, msg in pairs
        if len(msg.modal_energy)
    ]
    t, energy = np.array(ends, float).reshape(-1, 2).T
    return t, energy


def estimated_energy(series: BagSeries) -> tuple[Array, Array]:
    """Return times (k,) and the vibration of every mode [J], (k, n_eta), with the model of each state.

    Raises:
        BagError: No state has a model.
    """
    models = {msg.model_id: _model(msg) for msg in series.messages("model")}
    t, rows = [], []
    for instant, msg in zip(series.times("modal_state"), series.messages("modal_state"), strict=True):
        model = models.get(msg.model_id)
        if model is not None and len(msg.eta) == model.n_eta:
            eta = np.array(msg.eta)
            eta[: len(msg.sag)] -= msg.sag
            x = np.concatenate([msg.theta, eta, msg.theta_dot, msg.eta_dot])
            t.append(float(instant))
            rows.append(vibration_energy(model, x[None])[0])
    if not t:
        raise BagError("no estimate is of a model that the bag holds")
    return np.array(t), np.array(rows)


def _model(msg: Any) -> ReducedModel:
    """Return the dynamics of a model message; its outputs are not needed."""
    n_theta, n = len(msg.theta_names), len(msg.theta_names) + len(msg.eta_names)
    M, D, K = (np.array(part, float).reshape(n, n) for part in (msg.mass, msg.damping, msg.stiffness))
    nothing = np.zeros((0, n))
    outputs = Outputs((), (), np.zeros(0), nothing, nothing, nothing)
    return ReducedModel(
        msg.manipulator, msg.config_id, tuple(msg.theta_names), np.array(msg.pose), M, D, K,
        np.array(msg.input).reshape(n, n_theta), np.array(msg.bias), np.sqrt(np.diag(K)[n_theta:]),
        np.array(msg.zeta), outputs, np.array(msg.q0), np.array(msg.phi).reshape(-1, n),
    )  # fmt: skip
