"""Measurements at other poses: "POSE=FILE" of the command line.

A pose that is given several times is one test of several runs, as several files are at the first pose: a test
with several motors has as many runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.measurement import SourceError, known_outputs
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.runs_apart import compare_runs
from flexarm_bringup.identify.sources import read_sources
from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.modal.fit import PoleFit
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class OtherPose:
    """A pose and the files of its test.

    Attributes:
        axes: Actuated axes [rad or m], (n_theta,).
        paths: Files.
        texts: As they were given.
    """

    axes: Array
    paths: tuple[Path, ...]
    texts: tuple[str, ...]

    def __str__(self) -> str:
        """Return the options as they were given."""
        return " ".join(f"--also '{text}'" for text in self.texts)


def other_poses(texts: Sequence[str]) -> list[OtherPose]:
    """Return the poses of "0.1,-0.2=run.csv": axes [rad or m] with commas between, and a file.

    Raises:
        SourceError: A text cannot be used.
    """
    found: dict[tuple[float, ...], OtherPose] = {}
    for text in texts:
        axes, path = _split(text)
        known = found.get(tuple(axes), OtherPose(axes, (), ()))
        found[tuple(axes)] = replace(known, paths=(*known.paths, path), texts=(*known.texts, text))
    return list(found.values())


def identify_there(
    there: OtherPose, kind: str, averaging: Averaging, request: Request, ignored: Sequence[str]
) -> tuple[Array, PoleFit]:
    """Return a pose and the modes identified there.

    Args:
        there: Pose and files.
        kind: Of its outputs, where the files do not say.
        averaging: For records.
        request: Of the test; its pose and its outputs are others.
        ignored: Outputs to leave out where the files have them.

    Raises:
        SourceError: A file cannot be used, or there is no mode in it.
    """
    arm = load_config(find_manipulator(request.manipulator), request.preset)
    try:
        source = read_sources(there.paths, kind, averaging, ignored, arm, must_have=False)
        left_out = known_outputs(source.responses.outputs, ignored, among=ignored)
        asked = replace(request, pose=tuple(there.axes.tolist()), ignore=left_out)
        compare_runs(source, asked, averaging)
        fit = identify(source, asked).own_fit
    except ValueError as error:
        raise SourceError(f"{there}: {error}") from error
    if fit is None:
        raise SourceError(f"{there}: no mode was identified")
    return there.axes, fit


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
    for there in other_poses(texts):
        for text, path in zip(there.texts, there.paths, strict=True):
            if not path.exists():
                raise SourceError(f"--also '{text}': {path}: no such file")
        arm.modes({}, there.axes)


def _split(text: str) -> tuple[Array, Path]:
    axes, equals, name = text.partition("=")
    try:
        pose = np.array([float(part) for part in axes.split(",")])
    except ValueError:
        equals = ""
    if not equals:
        raise SourceError(f"--also '{text}': expected POSE=FILE, such as 0.1,-0.2=run.csv")
    return pose, Path(name)
