"""Runs of one set-up: does each of them alone show the arm at the same frequencies?

The mean of two runs whose resonances lie ``d`` half-power bandwidths apart is, about the middle and with
``x`` the distance from it in half bandwidths::

    (1 / (1 + j (x + d)) + 1 / (1 + j (x - d))) / 2 = (1 + j x) / ((1 + j x)^2 + d^2)

Its peak is ``1 / (1 + d^2)`` of that of either, as if the damping were ``1 + d^2`` times what it is, and it
has two poles where either has one. So a tenth of a bandwidth changes the damping by 1 %, which is told; half
of one by 25 %, and the phase of either by 27 degrees: that is one arm no more than set-ups are one test that
differ by 20 % or 30 degrees (``set_ups``).

Every run is identified by itself, with its bootstrap: noise that is one run's own is not white. Where one
alone cannot part the inputs, as in a test with several motors, as few as can are taken together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.measurement import Records, SourceError
from flexarm_bringup.identify.mode_pairs import FITTED
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.sources import Source, of_records
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_model.modal.fit import PoleFit

Array = NDArray[np.float64]
TOLD, REFUSED = 0.1, 0.5  # half-power bandwidths between the slowest and the fastest run
CERTAIN = 4.0  # sigmas of a difference that noise does not explain, as a mode must stand out of it


@dataclass(frozen=True)
class Apart:
    """A mode that runs show at different frequencies.

    Attributes:
        names: Of the runs that show modes.
        f_hz: Its frequency in every run, nan where that does not show it [Hz], (runs,).
        f_std_hz: One sigma of them [Hz], (runs,).
        bandwidths: Between the fastest and the slowest, in half-power bandwidths [1].
    """

    names: tuple[str, ...]
    f_hz: Array
    f_std_hz: Array
    bandwidths: float

    def __str__(self) -> str:
        """Return the frequencies, run by run."""
        told = ", ".join(
            f"{f:.4f} Hz in {name}" for name, f in zip(self.names, self.f_hz, strict=True) if np.isfinite(f)
        )
        return f"{told}: {self.bandwidths:.2f} of a half-power bandwidth apart"


def compare_runs(
    source: Source, request: Request, averaging: Averaging, say: Callable[[str], None] = lambda text: None
) -> tuple[Apart, ...]:
    """Return the modes that runs of one set-up show further apart than noise and levels explain.

    Args:
        source: What was measured.
        request: What was asked of it; the manipulator is of no account.
        averaging: For records.
        say: Is told which run is being identified.

    Raises:
        SourceError: Runs are so far apart that their mean is of no arm; names the frequencies.
    """
    alone = replace(request, manipulator="")
    told = tuple(mode for runs in source.set_ups for mode in _apart(_fits(runs, alone, averaging, say)))
    worst = max(told, key=lambda mode: mode.bandwidths, default=None)
    if worst is not None and worst.bandwidths > REFUSED:
        raise SourceError(
            f"runs of one set-up show different arms: {worst}; above {REFUSED:g} their mean is of none of "
            "them: identify them one at a time; flexarm drift BAG tells when an arm changed"
        )
    return told


def run_tables(told: Sequence[Apart]) -> list[Table]:
    """Return the frequencies of every run; no table where there is nothing to tell."""
    if not told:
        return []
    heads = [
        Column("frequency\n[Hz]", ".4f"),
        Column("±\n[Hz]", ".4f"),
        Column("run"),
        Column("all runs,\nbandwidths apart", ".2f"),
    ]
    rows: list[Cells] = [
        [float(f), float(f_std), name, mode.bandwidths]
        for mode in told
        for name, f, f_std in zip(mode.names, mode.f_hz, mode.f_std_hz, strict=True)
        if np.isfinite(f)
    ]
    notes = [
        "runs of one set-up show these modes further apart than noise explains: did the arm change between "
        "them?",
        f"d half-power bandwidths apart make the damping of the mean about 1 + d^2 times too high; above "
        f"{REFUSED:g} runs are refused",
    ]
    return [Table("Runs apart", heads, rows, notes)]


def _apart(fits: Mapping[str, PoleFit]) -> Iterator[Apart]:
    """Yield the modes that runs of one set-up show apart."""
    if len(fits) < 2:
        return
    names, (first, *others) = tuple(fits), fits.values()
    found = [np.arange(first.model.f_hz.size), *(_partners(first, other) for other in others)]
    for places in zip(*found, strict=True):
        pairs = list(zip(fits.values(), places, strict=True))
        f = np.array([fit.model.f_hz[i] if i >= 0 else np.nan for fit, i in pairs])
        f_std = np.array([fit.f_std_hz[i] if i >= 0 else np.nan for fit, i in pairs])
        width = np.mean([2.0 * fit.model.zeta[i] * fit.model.f_hz[i] for fit, i in pairs if i >= 0])
        low, high = int(np.nanargmin(f)), int(np.nanargmax(f))
        mode = Apart(names, f, f_std, float((f[high] - f[low]) / width))
        noise = CERTAIN * float(np.hypot(f_std[low], f_std[high]))
        if mode.bandwidths > TOLD and f[high] - f[low] > noise:
            yield mode


def _partners(first: PoleFit, other: PoleFit) -> NDArray[np.intp]:
    """Return per mode of the first fit the one of the other that is nearest, each to each; -1 for none."""
    far = abs(np.log(first.model.f_hz[:, None] / other.model.f_hz[None, :]))
    nearest = far.argmin(axis=1)
    at = np.arange(nearest.size)
    is_mutual = (far.argmin(axis=0)[nearest] == at) & (far[at, nearest] < FITTED)
    return np.where(is_mutual, nearest, -1)


def _fits(
    runs: Sequence[Records], request: Request, averaging: Averaging, say: Callable[[str], None]
) -> dict[str, PoleFit]:
    """Return the modes of each run, or of each few; empty where only all together are responses."""
    for size in (n for n in range(1, len(runs)) if len(runs) % n == 0):
        parts = {_name(at, size, runs): runs[at : at + size] for at in range(0, len(runs), size)}
        fits = {}
        try:
            for name, part in parts.items():
                say(f"{name} by itself")
                fits[name] = identify(of_records(part, averaging), request).own_fit
        except (SourceError, ValueError):
            continue
        return {name: fit for name, fit in fits.items() if fit is not None and fit.model.f_hz.size}
    return {}


def _name(at: int, size: int, runs: Sequence[Records]) -> str:
    """Return what runs are called: their place, and the files that they come from."""
    place = f"run {at + 1}" if size == 1 else f"runs {at + 1} to {at + size}"
    files = ", ".join(dict.fromkeys(run.file for run in runs[at : at + size] if run.file))
    return f"{place} ({files})" if files else place
