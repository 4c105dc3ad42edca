"""What seed 002 is compared with, and how: its tables, the model's first mode, the fitted conventions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.reference import Row, column, read_reference
from flexarm_bringup.reproduce.vibration import Damping, Mode, PowerLaw, simulate
from flexarm_bringup.residual import lowpass, rms
from flexarm_bringup.share import share_path
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.motion.profiles import Profile, Trapezoid
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

RATE_HZ = 512.0  # of the paper's accelerometer
SENSOR = "tip_accelerometer.y"


@dataclass(frozen=True)
class Calibration:
    """Three fitted numbers reproduce Table 2; two of them per column.

    Attributes:
        name: Which column of Table 2.
        damping: Damping ratio over velocity; its exponent is shared by both columns.
        window: RMS from t = 0 to here [s]; the data bound it only to 3.5 ... 7 s.
    """

    name: str
    damping: PowerLaw
    window: float


SIMULATION = Calibration("simulation", PowerLaw(0.032), 4.55)
EXPERIMENT = Calibration("experiment", PowerLaw(0.022), 7.15)
CALIBRATIONS = {"sim": SIMULATION, "exp": EXPERIMENT}


@dataclass(frozen=True)
class ModalData:
    """The arm's modes with the hub locked.

    Attributes:
        config: What was modelled.
        f_hz: Frequencies [Hz], (n,).
        participation: Of the sensor per unit hub acceleration [m], (n,).
        sensor_radius: From the axis [m].
        tip_radius: From the axis [m].
        tip_share: Deflection of the tip over that of the sensor, mode 1 [1].
        zeta: Damping ratios as described [1], (n,); table 2 has laws of its own.
    """

    config: ManipulatorConfig
    f_hz: Array
    participation: Array
    sensor_radius: float
    tip_radius: float
    tip_share: float
    zeta: Array

    @property
    def first(self) -> Mode:
        """The first mode, which alone makes Table 2 (its 20 Hz filter removes the others)."""
        return Mode(2.0 * np.pi * float(self.f_hz[0]), float(self.participation[0]))


def modal_data(preset: str = "") -> ModalData:
    """Return the modes of the product's own model; preset "printed" has E = 210 GPa."""
    config = load_config(share_path("config/manipulators/single_link.yaml"), preset)
    model = linearize(ReducedTree(config))
    sensor, tip = (model.outputs.names.index(name) for name in (SENSOR, "tip.ty"))
    seen, moved = model.outputs.C_acc[sensor], model.outputs.C_pos[tip]
    participation = model.M[0, 1:] * seen[1:]
    share = float(moved[1] / seen[1])
    return ModalData(
        config,
        model.omega / (2.0 * np.pi),
        participation,
        float(seen[0]),
        float(moved[0]),
        share,
        model.zeta,
    )


@dataclass(frozen=True)
class Record:
    """A filtered record of one case: times [s] and relative acceleration [m/s^2], each (k,)."""

    t: Array
    acceleration: Array

    @property
    def rms(self) -> float:
        """Over the whole record [m/s^2]."""
        return rms(self.acceleration)

    @property
    def peak(self) -> float:
        """Largest magnitude [m/s^2]."""
        return float(np.abs(self.acceleration).max())


Records = Mapping[str, Mapping[str, Record]]  # column ("sim", "exp") -> case -> record


@dataclass(frozen=True)
class Published:
    """Both tables of the paper."""

    table1: dict[str, Row]
    table2: dict[str, Row]

    @cached_property
    def rms(self) -> dict[str, dict[str, float]]:
        """Printed RMS [m/s^2] by column ("sim", "exp") and case."""
        return {key: column(self.table2, f"{key}_rms_m_s2") for key in CALIBRATIONS}

    @cached_property
    def motions(self) -> dict[str, Trapezoid]:
        """The motions as printed, with the misprinted t_d put right."""
        columns = [column(self.table1, name) for name in ("theta_deg", "t_m_s", "t_a_s", "t_d_s")]
        motions = {}
        for case in self.table1:
            theta_deg, t_m, t_a, t_d = (values[case] for values in columns)
            motions[case] = Trapezoid(math.radians(theta_deg), t_m, t_a, t_d)
        return motions


def read_published() -> Published:
    """Return the paper's tables."""
    return Published(read_reference("seed002_table1"), read_reference("seed002_table2"))


def record(motion: Profile, mode: Mode, damping: Damping, window: float) -> Record:
    """Return what the paper's instrument would have recorded from t = 0 to ``window`` [s]."""
    vibration = simulate(motion, mode, damping, RATE_HZ, int(window * RATE_HZ))
    return Record(vibration.t, lowpass(vibration.acceleration, RATE_HZ))


def record_all(modes: ModalData, published: Published) -> Records:
    """Return every case under both calibrations."""
    return {
        key: {case: record(m, modes.first, fit.damping, fit.window) for case, m in published.motions.items()}
        for key, fit in CALIBRATIONS.items()
    }


def errors(predicted: dict[str, float], measured: dict[str, float]) -> dict[str, float]:
    """Return ``100 (predicted - measured) / measured`` [%] of every case that was predicted."""
    return {case: 100.0 * (value / measured[case] - 1.0) for case, value in predicted.items()}


def mean_and_max(percent: dict[str, float]) -> tuple[float, float]:
    """Return mean and maximum of the magnitudes."""
    magnitudes = np.abs(list(percent.values()))
    return float(magnitudes.mean()), float(magnitudes.max())
