"""What every sensor buys: the same bag estimated again without it.

The tip's error is the distance from the truth where the bag has it, else from the estimate of all sensors.
Modes have no truth that anyone could measure, so their error is against the estimate of all sensors. They
are told by what they do at the tip, ``|J_k| eta_k``, in metres.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.named_arm import NamedArm
from flexarm_bringup.consistency.recording import Told, open_recording, run_estimator
from flexarm_bringup.consistency.settled import SETTLING, is_settled
from flexarm_estimator.estimate import Estimate

Array = NDArray[np.float64]
NONE = "none"  # left out


@dataclass(frozen=True)
class Ablation:
    """A bag to estimate without a sensor (or with all, ``NONE``), and the arm that was named for it."""

    path: Path
    sensor: str
    arm: NamedArm | None = None


@dataclass(frozen=True)
class Track:
    """What one run said; k instants.

    Attributes:
        sensor: Left out.
        stamps_ns: [ns], (k,).
        tip: Position [m], (k, 3).
        tip_sigma: All directions together [m], (k,).
        modes: At the tip [m], (k, n_eta).
        mode_sigmas: (k, n_eta).
        usable: (k,).
        in_use: Whether a sensor was, by its name (k,): neither silent, off nor found out to be faulty.
    """

    sensor: str
    stamps_ns: tuple[int, ...]
    tip: Array
    tip_sigma: Array
    modes: Array
    mode_sigmas: Array
    usable: NDArray[np.bool_]
    in_use: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)

    def at(self, kept: NDArray[np.bool_]) -> Track:
        """Return what was said at some of the instants, (k,)."""
        return replace(
            self,
            stamps_ns=tuple(stamp for stamp, one in zip(self.stamps_ns, kept, strict=True) if one),
            tip=self.tip[kept],
            tip_sigma=self.tip_sigma[kept],
            modes=self.modes[kept],
            mode_sigmas=self.mode_sigmas[kept],
            usable=self.usable[kept],
            in_use={name: row[kept] for name, row in self.in_use.items()},
        )

    def where_usable(self) -> Track:
        """Return what was said where a law might have acted on it."""
        return self.at(self.usable)


def run_ablation(job: Ablation) -> list[Track]:
    """Estimate a bag without a sensor."""
    recording = open_recording(job.path, job.arm)
    told = run_estimator(recording, () if job.sensor == NONE else (job.sensor,))
    return [track_of(job.sensor, told)]


def track_of(sensor: str, told: Sequence[Told]) -> Track:
    """Return what a run said, where it was settled."""
    counts = is_settled(item.estimate for item in told)
    settled = [item for item, one in zip(told, counts, strict=True) if one]
    estimates = [item.estimate for item in settled]
    variances = [np.diag(each.P)[each.layout.eta] for each in estimates]
    shape = len(settled), told[0].estimate.eta.size
    reach = np.reshape([_at_tip(item) for item in settled], shape)
    return Track(
        sensor=sensor,
        stamps_ns=tuple(item.stamp_ns for item in settled),
        tip=np.reshape([each.T_world_tip[:3, 3] for each in estimates], (-1, 3)),
        tip_sigma=np.array([np.sqrt(np.trace(each.cov_tip_pose[:3, :3])) for each in estimates]),
        modes=reach * np.reshape([each.eta for each in estimates], shape),
        mode_sigmas=reach * np.sqrt(np.reshape(variances, shape)),
        usable=np.array([each.is_usable for each in estimates], dtype=bool),
        in_use=_in_use(estimates),
    )


def refuse_unsettled(tracks: Sequence[Track], path: Path) -> None:
    """Raise BagError where nothing of one of some runs counts."""
    if not all(track.stamps_ns for track in tracks):
        raise BagError(
            f"{path}: no estimate counts: the first {SETTLING:g} s after every start of the filter are left "
            "out; expected a longer recording"
        )


def _in_use(estimates: Sequence[Estimate]) -> dict[str, NDArray[np.bool_]]:
    rows: dict[str, list[bool]] = {}
    for each in estimates:
        for report in each.sensors:
            is_heard = report.status in ("ok", "rejected") and report.accepted > 0
            rows.setdefault(report.name, []).append(is_heard)
    return {name: np.array(row) for name, row in rows.items()}


def _at_tip(item: Told) -> Array:
    """Return how far the tip moves per unit of every mode [kg^-0.5], (n_eta,)."""
    model = item.model
    rows = model.outputs.rows("tip")[:3]
    return np.asarray(np.linalg.norm(model.outputs.C_pos[rows, model.n_theta :], axis=0))
