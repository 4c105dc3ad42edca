"""What a sensor buys: judged on tracks whose errors are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup import ablate, cli
from flexarm_bringup.ablate import build_page, draw
from flexarm_bringup.consistency.ablation import NONE, Track, track_of
from flexarm_bringup.consistency.recording import Recording, open_recording, run_estimator
from flexarm_bringup.consistency.worth import judge_tracks

STAMPS = (0, 10, 20, 30)


def track(sensor: str, off: float, stamps: tuple[int, ...] = STAMPS) -> Track:
    k = len(stamps)
    tip = np.zeros((k, 3))
    tip[:, 1] = off
    return Track(
        sensor,
        stamps,
        tip,
        np.full(k, 2e-3),
        np.full((k, 2), off),
        np.full((k, 2), 1e-3),
        np.ones(k, dtype=bool),
    )


def test_errors_are_against_the_truth_where_there_is_one() -> None:
    truth = {stamp: np.array([0.0, 1e-3, 0.0]) for stamp in STAMPS}
    base, without = judge_tracks([track(NONE, 0.0), track("gauge", -2e-3)], truth)
    assert base.tip == pytest.approx(1e-3)
    assert without.tip == pytest.approx(3e-3)
    np.testing.assert_allclose(without.modes, 2e-3)


def test_without_a_truth_errors_are_against_all_sensors() -> None:
    base, without = judge_tracks([track(NONE, 1e-3), track("gauge", -2e-3)], {})
    assert base.tip == 0.0
    assert without.tip == pytest.approx(3e-3)


def test_only_instants_that_both_have_are_compared() -> None:
    truth = {10: np.zeros(3), 40: np.full(3, 9.0)}
    _, without = judge_tracks([track(NONE, 0.0), track("gauge", 4e-3, (10, 20, 50))], truth)
    assert without.tip == pytest.approx(4e-3)


def test_a_truth_of_other_instants_tells_nothing_of_a_track() -> None:
    """The gauge's track shares no instant with anything, the other one some with the truth."""
    base, strange = judge_tracks([track(NONE, 1e-3), track("gauge", 4e-3, (5, 15))], {10: np.zeros(3)})
    assert base.tip == pytest.approx(1e-3)
    assert np.isnan(strange.tip) and np.isnan(strange.modes).all() and strange.modes.shape == (2,)


def test_a_truth_at_none_of_the_stamps_is_none_and_is_said_to_be_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    golden = Path(__file__).parents[3] / "tests" / "golden" / "single_link" / "bag"
    monkeypatch.setattr(ablate, "run_parallel", lambda *_: [track(NONE, 0.0), track("gauge", -2e-3)])
    monkeypatch.setattr(Recording, "true_tip", lambda recording: {5: np.ones(3)})
    assert cli.main(["ablate", str(golden)]) == 0
    said = capsys.readouterr().out
    assert "the bag has no truth at the stamps of the estimates" in said and "2000.0" in said


def test_a_bag_in_which_no_filter_settles_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All of it was judged: the transient of the start."""
    golden = Path(__file__).parents[3] / "tests" / "golden" / "single_link" / "bag"
    young = run_estimator(open_recording(golden))[:40]  # 0.2 s
    monkeypatch.setattr(ablate, "run_parallel", lambda *_: [track_of(NONE, young), track("gauge", 0.0)])
    assert cli.main(["ablate", str(golden)]) == 2
    assert "no estimate counts: the first 0.3 s after every start" in capsys.readouterr().err


def test_a_run_tells_where_every_sensor_was_in_use() -> None:
    golden = Path(__file__).parents[3] / "tests" / "golden" / "single_link" / "bag"
    run = track_of("camera", run_estimator(open_recording(golden), ["camera"]))
    assert set(run.in_use) == {"encoder", "root_strain", "tip_accelerometer", "camera"}
    assert {name for name, row in run.in_use.items() if not row.any()} == {"camera"}
    assert run.in_use["encoder"].all() and len(run.in_use["encoder"]) == len(run.stamps_ns)


def test_page_says_what_is_bought_and_against_what() -> None:
    truth = {stamp: np.array([0.0, 1e-3, 0.0]) for stamp in STAMPS}
    results = judge_tracks([track(NONE, 0.0), track("gauge", -2e-3)], truth)
    page = build_page(Path("bag"), results, truth, [draw(results, truth)])
    text = page.to_text()
    assert "3000.0" in text
    assert "3.00" in text
    assert "gauge" in page.to_html()
    assert "the bag has no truth" in build_page(Path("bag"), results, {}).to_text()
