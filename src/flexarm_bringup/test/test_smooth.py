"""A bag looked back at: times, files, and what is said where there is no truth."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup import cli, smooth
from flexarm_bringup.bags.bag_reader import Record
from flexarm_bringup.consistency.ablation import NONE, Track
from flexarm_bringup.consistency.recording import Recording, open_recording, telling
from flexarm_bringup.consistency.smoothing import Late, run_smoother, tip_error
from flexarm_bringup.smooth import build_page, draw, judged_with, write_csv

STAMPS = (0, 10, 20, 30)
ARGS = argparse.Namespace(bag=Path("bag"), lag=0.3, loss=None)


def late(off: float) -> Late:
    k, tip = len(STAMPS), np.zeros((len(STAMPS), 3))
    tip[:, 1] = off
    return Late(np.array(STAMPS), tip, np.full(k, 1e-3), np.full((k, 2), off), np.full((k, 2), 3.0))


def track(off: float) -> Track:
    run = late(off)
    return Track(NONE, STAMPS, run.tip, run.tip_sigma, run.eta, run.eta, np.ones(len(STAMPS), dtype=bool))


def test_the_tip_is_compared_where_both_are_known() -> None:
    truth = {10: np.zeros(3), 20: np.array([0.0, 3e-3, 0.0]), 99: np.ones(3)}
    assert tip_error(STAMPS, late(1e-3).tip, truth) == pytest.approx(math.sqrt((1e-6 + 4e-6) / 2))
    assert math.isnan(tip_error(STAMPS, late(1e-3).tip, {}))


def test_what_was_before_the_estimate_settled_is_left_out() -> None:
    assert judged_with(late(1.0), (20, 30, 40)).stamps_ns.tolist() == [20, 30]
    assert judged_with(late(1.0), (20, 30)).eta.shape == (2, 2)


def test_the_file_has_a_line_per_instant_with_its_units(tmp_path: Path) -> None:
    write_csv(tmp_path / "states.csv", late(2e-3))
    head, *lines = (tmp_path / "states.csv").read_text().splitlines()
    assert head.startswith("stamp [ns],x [m]") and head.endswith("rate of mode 2 [kg^0.5 m/s]")
    assert len(lines) == len(STAMPS) and lines[1] == "10,0,0.002,0,0.001,0.002,0.002,3,3"


def test_states_on_the_standard_output_have_it_for_themselves(
    bag_of_golden: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(smooth, "run_smoother", lambda *_: late(2e-3))
    monkeypatch.setattr(smooth, "run_estimator", lambda recording, tell: [])
    monkeypatch.setattr(smooth, "track_of", lambda *_: track(4e-3))
    assert cli.main(["smooth", str(bag_of_golden), "--csv", "-"]) == 0
    said = capsys.readouterr()
    assert len(said.out.splitlines()) == 1 + len(STAMPS) and said.out.startswith("stamp [ns],x [m]")
    assert "looked back at" in said.err and not (tmp_path / "-").exists()
    assert cli.main(["smooth", str(bag_of_golden), "--csv", "-", "--json", "-"]) == 2
    assert "has the standard output for itself" in capsys.readouterr().err


@pytest.mark.parametrize("truth", [{}, {stamp: np.zeros(3) for stamp in STAMPS}], ids=["without", "with"])
def test_the_page_compares_with_the_truth_or_says_that_there_is_none(truth: dict[int, np.ndarray]) -> None:
    figure = draw(track(4e-3), late(1e-3), truth)
    page = build_page(ARGS, track(4e-3), late(1e-3), truth, [figure])
    text = page.to_text()
    assert ("no truth" in text) == (not truth)
    assert ("4000.0" in text and "1000.0" in text) == bool(truth)
    assert ("truth" in figure.caption) == bool(truth)


def test_a_truth_at_none_of_the_stamps_is_drawn_as_none(
    bag_of_golden: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, stub in (("run_smoother", late(2e-3)), ("run_estimator", []), ("track_of", track(4e-3))):
        monkeypatch.setattr(smooth, name, lambda *_, told=stub, **__: told)
    monkeypatch.setattr(Recording, "true_tip", lambda recording: {5: np.ones(3)})
    page = tmp_path / "page.html"
    assert cli.main(["smooth", str(bag_of_golden), "--html", str(page)]) == 0
    assert "the bag has no truth at the stamps of the estimates" in page.read_text()


def test_every_second_of_a_bag_that_is_over_is_told_with_how_many_there_are() -> None:
    """Eleven seconds with --loss huber are minutes, and the line said "smoothing" all the time."""
    records = [Record("/tick", "", round(9e9 + 0.4e9 * k), b"") for k in range(9)]  # 3.2 s
    told: list[tuple[int, int]] = []
    bag: Any = SimpleNamespace(records=records)
    played: Any = [(record, k) for k, record in enumerate(records)]
    assert list(telling(played, bag, lambda *now: told.append(now))) == list(range(9))
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert list(telling(played, bag, None)) == list(range(9))


def test_a_loss_of_squares_is_the_smoother_and_another_is_not(bag_of_golden: Path) -> None:
    recording = open_recording(bag_of_golden)
    runs = [run_smoother(recording, 0.1, loss) for loss in (None, "square", "huber")]
    np.testing.assert_array_equal(runs[0].tip, runs[1].tip)
    moved = np.linalg.norm(runs[2].tip - runs[0].tip, axis=1)
    assert 0.0 < moved.max() < 1e-4  # nothing is off in this bag


@pytest.fixture
def bag_of_golden() -> Path:
    return Path(__file__).parents[3] / "tests" / "golden" / "single_link" / "bag"
