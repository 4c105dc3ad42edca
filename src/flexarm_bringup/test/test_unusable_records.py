"""Records and responses that tell nothing are refused by channel; what is left out spoils nothing."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from identify_files import F_HZ, record

from flexarm_bringup import cli

BAND = ("--resolution", "0.25", "--band", "5", "45")


def changed(tmp_path: Path, **more: Any) -> str:
    """Write a record of 20 s at 200 Hz with some columns changed; return its path."""
    source = record(tmp_path / "run.npz", seconds=20.0)
    with np.load(source) as file:
        np.savez(source, **{**file, **more})
    return str(source)


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run identify without a warning of NumPy or Matplotlib; return why it refuses."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cli.main(["identify", *words]) == 2
    return capsys.readouterr().err


def spoilt(n: int = 4000) -> np.ndarray:
    y = np.random.default_rng(3).standard_normal(n)
    y[[7, 9]] = np.nan, np.inf
    return y


def test_samples_that_are_no_numbers_are_told_with_their_channel(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(tmp_path, **{"out:b": spoilt()})
    assert "not finite: 2 of 4000 samples of output b; repair" in refused([path], capsys)
    path = changed(tmp_path, **{"in:force": spoilt()})
    assert "not finite: 2 of 4000 samples of input force; repair" in refused([path], capsys)


def test_an_output_that_is_left_out_need_not_be_finite(tmp_path: Path) -> None:
    path, report = changed(tmp_path, **{"out:b": spoilt()}), tmp_path / "report.json"
    assert cli.main(["identify", path, *BAND, "--ignore-channel", "b", "--json", str(report)]) in (0, 1)
    rows = json.loads(report.read_text())["tables"][0]["rows"]
    digital = np.arctan(np.pi * F_HZ / 200.0) * 200.0 / np.pi  # where the bilinear filter has its modes
    assert [row[1] for row in rows] == pytest.approx(digital, rel=0.01)


def test_an_input_that_never_moves_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = changed(tmp_path, **{"in:force": np.full(4000, 2.0)})
    assert "input force never moves" in refused([path], capsys)


@pytest.mark.parametrize(
    ("hz", "said"),
    [
        ("1000", "--resolution: a block has 0 samples; expected at most 50 Hz"),
        (
            "0.001",
            "4000 samples is shorter than a block of 200000: expected a longer record, or --resolution 0.05",
        ),
    ],
)
def test_a_resolution_that_a_record_cannot_have_is_told_with_what_it_can(
    hz: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in refused([changed(tmp_path), "--resolution", hz], capsys)


def test_runs_whose_stamps_are_rounded_have_one_rate(tmp_path: Path) -> None:
    """A third of a millisecond in six digits: the mean step is another one in every run."""
    rng, paths = np.random.default_rng(5), []
    for k, n in enumerate((3000, 3101)):
        t, values = np.round(np.arange(n) / 300.0, 6), rng.standard_normal((2, n))
        paths.append(tmp_path / f"{k}.npz")
        np.savez(paths[-1], **{"t": t, "in:u": values[0], "out:a": values[1]})
    assert cli.main(["identify", *map(str, paths)]) in (0, 1)


def test_a_window_that_there_is_not_is_refused_by_its_option(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("nonsense", "kaiser"):
        with pytest.raises(SystemExit):
            cli.main(["identify", "run.npz", "--window", name])
        assert f"argument --window: '{name}': expected a window" in capsys.readouterr().err


def responses(tmp_path: Path, **more: Any) -> str:
    f_hz = np.arange(1.0, 60.0, 0.1)
    H = 1 / (20.0**2 - f_hz**2 + 0.8j * f_hz)
    np.savez(tmp_path / "H.npz", **{"f_hz": f_hz, "a/f": H, **more})
    return str(tmp_path / "H.npz")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"f_hz": np.arange(60.0, 1.0, -0.1)}, "H.npz: its lines are not frequencies that ascend"),
        ({"f_hz": np.append(np.nan, np.arange(1.1, 60.0, 0.1))}, "H.npz: its lines are not frequencies"),
        ({"b/f.coherence": np.ones(590)}, "H.npz: a coherence, but no response of b/f"),
        ({"b/f": np.full(590, np.nan)}, "not finite: 590 of 590 lines of b/f; repair"),
    ],
)
def test_responses_that_cannot_be_used_are_told_by_name(
    more: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in refused([responses(tmp_path, **more)], capsys)


def test_a_band_beside_all_lines_is_refused_without_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "no line in 500.0..900.0 Hz" in refused([changed(tmp_path), "--band", "500", "900"], capsys)


def test_an_output_that_says_nothing_is_drawn_and_has_no_mode_which_is_no_success(tmp_path: Path) -> None:
    path, page = responses(tmp_path, **{"a/f": np.zeros(590)}), tmp_path / "page.html"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cli.main(["identify", path, "--html", str(page)]) == 1
    assert "no mode stands out" in page.read_text()


def test_options_for_records_are_refused_where_the_file_holds_responses(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refused([responses(tmp_path), "--resolution", "0.5", "--estimator", "H2"], capsys)
    assert "--resolution, --estimator: goes with records in time; the files hold responses" in said
