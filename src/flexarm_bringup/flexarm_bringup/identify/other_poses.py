"""Measurements at other poses: "POSE=FILE" of the command line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.sources import read_sources
from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.modal.fit import PoleFit
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

Array = NDArray[np.float64]


def read_pose(text: str, kind: str, averaging: Averaging, request: Request) -> tuple[Array, PoleFit]:
    """Return a pose and the modes identified there.

    Args:
        text: "0.1,-0.2=run.csv": axes [rad or m] with commas between, and a file.
        kind: Of its outputs, where the file does not say.
        averaging: For records.
        request: Of the test; its pose is another one.

    Raises:
        SourceError: The text or the file cannot be used, or there is no mode in it.
    """
    pose, path = _split(text)
    there = replace(request, pose=tuple(pose.tolist()))
    arm = load_config(find_manipulator(request.manipulator), request.preset)
    fit = identify(read_sources([path], kind, averaging, arm=arm), there).own_fit
    if fit is None:
        raise SourceError(f"--also {path}: no mode was identified")
    return pose, fit


def file_of(text: str) -> Path:
    """Return the file of "POSE=FILE".

    Raises:
        SourceError: The text cannot be used.
    """
    return _split(text)[1]


def refuse_unusable(texts: Sequence[str], manipulator: str, preset: str) -> None:
    """Refuse poses that the arm cannot have, and files that are not there, before anything is measured.

    Raises:
        SourceError: A text or its file cannot be used.
        PoseError, ClosureError: There is no model at a pose.
    """
    if not texts:
        return
    arm = DescribedArm(find_manipulator(manipulator), preset, False)
    for text in texts:
        pose, path = _split(text)
        if not path.exists():
            raise SourceError(f"--also '{text}': {path}: no such file")
        arm.modes({}, pose)


def _split(text: str) -> tuple[Array, Path]:
    axes, equals, name = text.partition("=")
    try:
        pose = np.array([float(part) for part in axes.split(",")])
    except ValueError:
        equals = ""
    if not equals:
        raise SourceError(f"--also '{text}': expected POSE=FILE, such as 0.1,-0.2=run.csv")
    return pose, Path(name)
