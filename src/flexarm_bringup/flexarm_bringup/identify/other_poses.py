"""Measurements at other poses: "POSE=FILE" of the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.sources import Averaging, read_sources
from flexarm_model.modal.fit import PoleFit

Array = NDArray[np.float64]


def read_pose(text: str, kind: str, averaging: Averaging, request: Request) -> tuple[Array, PoleFit]:
    """Return a pose and the modes identified there.

    Args:
        text: "0.1,-0.2=run.csv": axes [rad or m] with commas between, and a file.
        kind: Of its outputs, where the file does not say.
        averaging: For records.
        request: Band and coherence.

    Raises:
        SourceError: The text or the file cannot be used, or there is no mode in it.
    """
    axes, equals, name = text.partition("=")
    try:
        pose = np.array([float(part) for part in axes.split(",")])
    except ValueError:
        equals = ""
    if not equals:
        raise SourceError(f"--also '{text}': expected POSE=FILE, such as 0.1,-0.2=run.csv")
    fit = identify(read_sources([Path(name)], kind, averaging), request).found.fit
    if fit is None:
        raise SourceError(f"--also {name}: no mode was identified")
    return pose, fit
