"""What every sensor buys, judged where the estimates may be used: an estimate that is lost says so itself.

Two runs are compared at the instants at which both may be used and the sensor was in use. One is better
where the squares of its errors are less by more than they scatter from one part of the record to the next::

    d_k = mean over part k of (e_without^2 - e_all^2),   mean(d) < -2 std(d) / sqrt(n)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.consistency.ablation import NONE, Track

Array = NDArray[np.float64]
PARTS = 10  # of the record, by which scatter is told
SURE = 2.0  # sigmas of the mean


@dataclass(frozen=True)
class Without:
    """What is left without a sensor, at instants at which the estimate may be used.

    Attributes:
        sensor: The one left out.
        tip: RMS error of the tip [m]; NaN where nothing tells it.
        ratio: To that with all sensors, at the instants of both at which the sensor was in use [1]; NaN where
            nothing tells it.
        is_better: It is less than that, by more than it scatters.
        tip_sigma: RMS of what the estimate says of it [m]; NaN where nothing tells it, as all of these.
        modes: RMS difference of every mode from the estimate of all sensors, at the tip [m], (n_eta,).
        mode_sigmas: RMS sigma of every mode, at the tip [m], (n_eta,).
        usable: Share of the estimates that were "ok" or "degraded" [1].
        in_use: Share of the instants at which the sensor was, when none was left out [1]; NaN for none.
    """

    sensor: str
    tip: float
    ratio: float
    is_better: bool
    tip_sigma: float
    modes: Array
    mode_sigmas: Array
    usable: float
    in_use: float


def judge_tracks(tracks: Sequence[Track], truth: Mapping[int, Array]) -> list[Without]:
    """Return what is left without every sensor; no figures of one that was never in use, or never settles.

    Args:
        tracks: The first one with all sensors.
        truth: Positions of the tip by stamp [m], (3,); empty compares with the first track. A track without
            any of its stamps gets NaN.
    """
    everything = tracks[0].where_usable()
    reference = dict(truth) or dict(zip(everything.stamps_ns, everything.tip, strict=True))
    return [_judge(track, everything, reference) for track in tracks]


def _judge(track: Track, everything: Track, reference: Mapping[int, Array]) -> Without:
    in_use = everything.in_use.get(track.sensor, np.ones(len(everything.stamps_ns), dtype=bool))
    told = track.where_usable() if in_use.any() else track.at(np.zeros(len(track.stamps_ns), dtype=bool))
    pairs = _pairs(told, everything.at(in_use), reference)
    modes = dict(zip(everything.stamps_ns, everything.modes, strict=True))
    off = [row - modes[at] for at, row in zip(told.stamps_ns, told.modes, strict=True) if at in modes]
    return Without(
        sensor=track.sensor,
        tip=float(_rms(np.sqrt(list(tip_squares(told, reference).values())))),
        ratio=_ratio(pairs),
        is_better=is_less(pairs[:, 0] - pairs[:, 1]),
        tip_sigma=float(_rms(told.tip_sigma)),
        modes=_rms(np.reshape(off, (-1, track.modes.shape[1]))),
        mode_sigmas=_rms(told.mode_sigmas),
        usable=_share(track.usable),
        in_use=np.nan if track.sensor == NONE else _share(in_use),
    )


def _pairs(one: Track, other: Track, reference: Mapping[int, Array]) -> Array:
    """Return squared errors of two runs at the instants of both, in order of time [m^2], (k, 2)."""
    first, second = tip_squares(one, reference), tip_squares(other, reference)
    rows = [(first[stamp], second[stamp]) for stamp in sorted(first.keys() & second.keys())]
    return np.reshape(rows, (-1, 2))


def tip_squares(track: Track, reference: Mapping[int, Array]) -> dict[int, float]:
    """Return the squared distance of the tip [m^2] from a position (3,) by stamp [ns], where there is one."""
    return {
        stamp: float(np.square(tip - reference[stamp]).sum())
        for stamp, tip in zip(track.stamps_ns, track.tip, strict=True)
        if stamp in reference
    }


def is_less(differences: Array) -> bool:
    """Return whether differences (k,), in order of time, are less than zero by more than they scatter."""
    if differences.size < PARTS:
        return False
    means = np.array([part.mean() for part in np.array_split(differences, PARTS)])
    return bool(means.mean() < -SURE * means.std(ddof=1) / np.sqrt(PARTS))


def _ratio(pairs: Array) -> float:
    """Return the quotient of the RMS of two columns of squares (k, 2); NaN without any, or by zero."""
    one, other = pairs.sum(axis=0)
    return float(np.sqrt(one / other)) if other > 0.0 else np.nan


def _share(kept: NDArray[np.bool_]) -> float:
    return float(kept.mean()) if kept.size else np.nan


def _rms(rows: Array) -> Array:
    """Return the RMS of every column of (k, ...); NaN without any row."""
    if not len(rows):
        return np.full(rows.shape[1:], np.nan)
    return np.asarray(np.sqrt(np.mean(np.square(rows), axis=0)))
