"""What every sensor buys: the same bag estimated again without it.

The tip's error is the distance from the truth where the bag has it, else from the estimate of all sensors.
Modes have no truth that anyone could measure, so their error is against the estimate of all sensors. They
are told by what they do at the tip, ``|J_k| eta_k``, in metres.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.named_arm import NamedArm
from flexarm_bringup.consistency.recording import Told, open_recording, run_estimator
from flexarm_bringup.consistency.settled import is_settled
from flexarm_bringup.consistency.smoothing import tip_error

Array = NDArray[np.float64]
NONE = "none"  # left out


@dataclass(frozen=True)
class Ablation:
    """A bag to estimate without a sensor (or with all, ``NONE``), and the arm that was named for it."""

    path: Path
    sensor: str
    arm: NamedArm | None = None


@dataclass(frozen=True)
class Without:
    """What is left without a sensor.

    Attributes:
        sensor: The one left out.
        tip: RMS error of the tip [m]; NaN where nothing tells it.
        tip_sigma: RMS of what the estimate says of it [m].
        modes: RMS difference of every mode from the estimate of all sensors, at the tip [m], (n_eta,).
        mode_sigmas: RMS sigma of every mode, at the tip [m], (n_eta,).
        usable: Share of the estimates that were "ok" or "degraded" [1].
    """

    sensor: str
    tip: float
    tip_sigma: float
    modes: Array
    mode_sigmas: Array
    usable: float


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
    """

    sensor: str
    stamps_ns: tuple[int, ...]
    tip: Array
    tip_sigma: Array
    modes: Array
    mode_sigmas: Array
    usable: Array


def run_ablation(job: Ablation) -> list[Track]:
    """Estimate a bag without a sensor."""
    recording = open_recording(job.path, job.arm)
    told = run_estimator(recording, () if job.sensor == NONE else (job.sensor,))
    return [track_of(job.sensor, told)]


def track_of(sensor: str, told: Sequence[Told]) -> Track:
    """Return what a run said, where it was settled; all of it if it never was."""
    counts = is_settled(item.estimate for item in told)
    settled = [item for item, one in zip(told, counts, strict=True) if one] or list(told)
    reach = [_at_tip(item) for item in settled]
    estimates = [item.estimate for item in settled]
    variances = [np.diag(each.P)[each.layout.eta] for each in estimates]
    return Track(
        sensor=sensor,
        stamps_ns=tuple(item.stamp_ns for item in settled),
        tip=np.array([each.T_world_tip[:3, 3] for each in estimates]),
        tip_sigma=np.array([np.sqrt(np.trace(each.cov_tip_pose[:3, :3])) for each in estimates]),
        modes=np.array([scale * each.eta for scale, each in zip(reach, estimates, strict=True)]),
        mode_sigmas=np.array([scale * np.sqrt(row) for scale, row in zip(reach, variances, strict=True)]),
        usable=np.array([float(each.is_usable) for each in estimates]),
    )


def judge_tracks(tracks: Sequence[Track], truth: Mapping[int, Array]) -> list[Without]:
    """Return what is left without every sensor.

    Args:
        tracks: The first one with all sensors.
        truth: Positions of the tip by stamp [m], (3,); empty compares with the first track. A track without
            any of its stamps gets NaN.
    """
    everything = tracks[0]
    reference = dict(truth) or dict(zip(everything.stamps_ns, everything.tip, strict=True))
    modes = dict(zip(everything.stamps_ns, everything.modes, strict=True))
    return [_judge(track, reference, modes) for track in tracks]


def _judge(track: Track, reference: Mapping[int, Array], modes: Mapping[int, Array]) -> Without:
    off = [row - modes[at] for at, row in zip(track.stamps_ns, track.modes, strict=True) if at in modes]
    rms = np.sqrt(np.mean(np.square(off), axis=0)) if off else np.full(track.modes.shape[1], np.nan)
    return Without(
        sensor=track.sensor,
        tip=tip_error(track.stamps_ns, track.tip, reference),
        tip_sigma=float(np.sqrt(np.mean(track.tip_sigma**2))),
        modes=rms,
        mode_sigmas=np.sqrt(np.mean(track.mode_sigmas**2, axis=0)),
        usable=float(track.usable.mean()),
    )


def _at_tip(item: Told) -> Array:
    """Return how far the tip moves per unit of every mode [kg^-0.5], (n_eta,)."""
    model = item.model
    rows = model.outputs.rows("tip")[:3]
    return np.asarray(np.linalg.norm(model.outputs.C_pos[rows, model.n_theta :], axis=0))
