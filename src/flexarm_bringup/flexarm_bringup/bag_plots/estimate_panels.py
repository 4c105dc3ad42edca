"""Panels of what was measured and known: modes, strain, accelerations, sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bag_plots.panel import QUIET, band, line, name_rows, reach, stacked, strip
from flexarm_bringup.bag_plots.series import BagSeries, constant_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

Array = NDArray[np.float64]
SHOWN_MODES = 6
SIGMAS = 3.0
GATE = 3.0  # innovations beyond so many sigma are rare


def draw_modes(plot: Plot, series: BagSeries) -> None:
    """Draw the modal amplitudes with three sigma."""
    first, t = series.messages("modal_state")[0], series.times("modal_state")
    eta = series.column("modal_state", lambda msg: msg.eta)
    sigma = series.column("modal_state", lambda msg: mode_sigma(msg.covariance, len(msg.theta), len(msg.eta)))
    for i, axes in enumerate(stacked(plot, min(eta.shape[1], SHOWN_MODES))):
        low, high = (eta[:, i] + side * SIGMAS * sigma[:, i] for side in (-1.0, 1.0))
        band(axes, t, low, high, color="C0", alpha=0.3, linewidth=0, label="3 sigma")
        line(axes, t, eta[:, i], label="estimate")
        axes.set_ylabel(f"{first.names[i]}\n[kg$^{{1/2}}$ m]")
        if i == 0:
            axes.legend(fontsize=8, ncols=2)


def mode_sigma(covariance: Array, n_theta: int, n_eta: int) -> Array:
    """Return one sigma of the modes from the covariance of a modal state, row major, (n_eta,); else NaN."""
    size = round(len(covariance) ** 0.5)
    if size**2 != len(covariance) or size < n_theta + n_eta:
        return np.full(n_eta, np.nan)
    variance = np.asarray(covariance, float).reshape(size, size).diagonal()[n_theta : n_theta + n_eta]
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def draw_strain(plot: Plot, series: BagSeries) -> None:
    """Draw the strain at every gauge, true too where it is known, and its limit where it comes near."""
    axes = plot.subplots()
    first = series.messages("strain")[0]
    sensors = series.config.sensors if series.config else ()
    gauges = {spec.name: spec for spec in sensors if spec.kind == "strain_gauge"}
    limits = {name: 1e6 * spec.limit for name, spec in gauges.items()}
    per_strain = [gauges[name].output if name in gauges else 1.0 for name in first.names]
    t, strain = series.times("strain"), 1e6 * series.column("strain", lambda msg: msg.strain) / per_strain
    for i, name in enumerate(first.names):
        near = reach(axes, strain[:, i], limits.get(name, np.inf))
        line(axes, t, strain[:, i], label=f"{name}{near and ', '}{near}")
    if series.has("truth"):
        truth = 1e6 * series.column("truth", lambda msg: msg.strain)
        for i in range(truth.shape[1]):
            line(axes, series.times("truth"), truth[:, i], label="truth" if i == 0 else None, **QUIET)
    axes.set(xlabel="time [s]", ylabel="strain [µm/m]")
    axes.legend(fontsize=8, ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def draw_inertial(plot: Plot, series: BagSeries) -> None:
    """Draw what accelerometers feel and gyroscopes tell, unit by unit."""
    found = [
        (topic, unit, felt)
        for topic in series.topics("imu/*")
        for field, unit in (("linear_acceleration", "m/s²"), ("angular_velocity", "rad/s"))
        if (felt := _felt(series, topic, field))
    ]
    for (topic, unit, felt), axes in zip(found, stacked(plot, max(len(found), 1)), strict=False):
        for name, (t, values) in felt.items():
            line(axes, t, values, label=name)
        axes.set_ylabel(f"{topic.rpartition('/')[2]}\n[{unit}]")
        axes.legend(fontsize=8, ncols=3)


def _felt(series: BagSeries, topic: str, field: str) -> dict[str, tuple[Array, Array]]:
    """Return times and values of the axes of a part of an IMU that tells something."""
    values = series.column(topic, lambda msg: [getattr(getattr(msg, field), axis) for axis in "xyz"])
    told = series.column(topic, lambda msg: getattr(msg, f"{field}_covariance")[0::4])
    t, felt = series.times(topic), {}
    for i, name in enumerate("xyz"):  # REP 145: -1 marks what is not measured, often in the first place only
        known = (told[:, i] > 0.0) | ((told[:, i] == 0.0) & (told[:, 0] >= 0.0))
        if values[known, i].any():
            felt[name] = t[known], values[known, i]
    return felt


def draw_sensors(plot: Plot, series: BagSeries) -> None:
    """Draw the health of every sensor as a strip, and its normalised innovations below."""
    messages, t = series.messages("modal_state"), series.times("modal_state")
    names = [sensor.name for sensor in messages[0].sensors]
    top, bottom = plot.subplots(2, 1, sharex=True, height_ratios=(1, 1.6))
    states, colours = constant_names(messages[0].sensors[0]) if names else {}, dict[str, str]()
    for row, name in enumerate(names):
        found = [{s.name: s for s in msg.sensors}.get(name) for msg in messages]
        strip(top, row, t, [states.get(s.status, "?") if s else "unknown" for s in found], colours)
        innovation = np.array([s.normalised_innovation if s else np.nan for s in found])
        line(bottom, t, innovation, label=name, linewidth=0.8)
    name_rows(top, names, colours)
    bottom.axhspan(0.0, GATE, color="#888888", alpha=0.15, linewidth=0)
    bottom.set(xlabel="time [s]", ylabel="normalised innovation [1]", ylim=(0.0, None))
    if names:
        bottom.legend(fontsize=8, ncols=4)
