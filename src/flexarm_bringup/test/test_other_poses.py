"""Measurements at other poses: which files are one test, and what is left out of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from identify_files import record

from flexarm_bringup.identify import other_poses
from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.identify.other_poses import identify_there
from flexarm_bringup.identify.run import Request
from flexarm_bringup.identify.sources import Source

REQUEST = Request(None, 0.6, "single_link", "geared", pose=(0.1,))
PERIOD = 400  # samples


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Source, Request]]:
    """Return what was to be identified; nothing is."""
    told = list[tuple[Source, Request]]()

    def identify(source: Source, request: Request) -> SimpleNamespace:
        """Note it."""
        told.append((source, request))
        return SimpleNamespace(own_fit="of it")

    monkeypatch.setattr(other_poses, "identify", identify)
    monkeypatch.setattr(other_poses, "compare_runs", lambda *_: ())
    return told


def identified(texts: list[str], ignored: tuple[str, ...] = (), request: Request = REQUEST) -> None:
    """Identify what stands on the command line."""
    for there in other_poses.other_poses(texts):
        identify_there(there, "receptance", Averaging(), request, ignored)


def spoilt(path: Path) -> Path:
    """Write a record of outputs a and b, and c of which a sample is missing."""
    with np.load(record(path, 20.0)) as file:
        columns = dict(file)
    columns["out:c"] = np.where(np.arange(columns["t"].size) == 7, np.nan, 1.0)
    np.savez(path, **columns)
    return path


def two_motors(folder: Path) -> list[str]:
    """Write the two runs of a test of two motors, together and against each other, at one pose."""
    rng, texts = np.random.default_rng(3), []
    u = np.tile(rng.standard_normal(PERIOD), 3)
    for number, sign in enumerate((1.0, -1.0), 1):
        columns = {"in:1": u, "in:2": sign * u, "out:a": u + 0.3 * sign * np.roll(u, 1)}
        path = folder / f"run_{number}.npz"
        np.savez(path, t=np.arange(u.size) / 200.0, repeats=PERIOD, **columns)
        texts.append(f"0.1,0.5={path}")
    return texts


def test_every_other_pose_has_its_own_model_beside(
    tmp_path: Path, asked: list[tuple[Source, Request]]
) -> None:
    path = record(tmp_path / "run.npz", 20.0)
    (there,) = other_poses.other_poses([f"-0.5={path}"])
    pose, fit = identify_there(there, "receptance", Averaging(), REQUEST, ())
    assert pose.tolist() == [-0.5] and fit == "of it"
    assert [request for _, request in asked] == [replace(REQUEST, pose=(-0.5,))]


def test_an_output_is_left_out_at_other_poses_too_where_the_file_has_it(
    tmp_path: Path, asked: list[tuple[Source, Request]]
) -> None:
    """A spoilt channel was refused with the advice to leave it out, which had been done."""
    texts = [f"0.1={spoilt(tmp_path / 'spoilt.npz')}", f"0.2={record(tmp_path / 'sound.npz', 20.0)}"]
    identified(texts, ("c",))
    assert [source.responses.outputs for source, _ in asked] == [("a", "b"), ("a", "b")]


def test_an_output_of_responses_is_left_out_where_the_first_file_held_records(
    tmp_path: Path, asked: list[tuple[Source, Request]]
) -> None:
    lines = np.linspace(1.0, 50.0, 100)
    np.savez(tmp_path / "frf.npz", f_hz=lines, **{"a/f": lines + 0j, "c/f": lines + 0j})
    identified([f"0.1={tmp_path / 'frf.npz'}"], ("c", "elsewhere"))
    assert [request.ignore for _, request in asked] == [("c",)]


def test_what_is_wrong_with_a_file_of_another_pose_is_told_with_its_option(
    tmp_path: Path, asked: list[tuple[Source, Request]]
) -> None:
    path = spoilt(tmp_path / "spoilt.npz")
    with pytest.raises(SourceError, match=rf"--also '0.1={path}': not finite: 1 of 4000 samples of output c"):
        identified([f"0.1={path}"])


def test_a_pose_that_is_given_again_is_another_run_of_its_test(
    tmp_path: Path, asked: list[tuple[Source, Request]]
) -> None:
    """One run of two motors cannot part them, and one file was all that a pose could have."""
    together, against = two_motors(tmp_path)
    with pytest.raises(SourceError, match=r"--also '0.1,0.5=.*run_1.npz': the inputs cannot be told apart"):
        identified([together])
    identified([together, against])
    ((source, request),) = asked
    assert (source.responses.inputs, len(source.records), request.pose) == (("1", "2"), 2, (0.1, 0.5))
