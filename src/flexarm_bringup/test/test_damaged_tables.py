"""Tables that are damaged, doubled or of different length are refused by file and column."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from flexarm_bringup import cli
from flexarm_bringup.identify.measurement import Records, Responses, SourceError
from flexarm_bringup.identify.table_source import read_table

N = 3000
T = np.arange(N) * 0.01


def columns(**more: Any) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    return {"t": T, "in:u": rng.standard_normal(N), "out:a": rng.standard_normal(N), **more}


def saved(path: Path, **more: Any) -> Path:
    np.savez(path, **columns(**more))
    return path


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"t": T[:500]}, "'in:u' has the shape"),
        ({"out:b": np.zeros((N, 2))}, "'out:b' has the shape"),
        ({"t": np.float64(3.0)}, "'t' has the shape"),
        ({"band_hz": np.array([3.0])}, "'band_hz' is"),
        ({"band_hz": np.array([9.0, 3.0])}, "'band_hz' is"),
        ({"repeats": -5}, "'repeats' is -5"),
        ({"repeats": 10**9}, "'repeats' is 1000000000"),
        ({"ref:x": np.zeros(N)}, "'ref:' of x, 'in:' of u"),
        ({"repeats": np.array([100, 200])}, r"'repeats' has the shape \(2,\); expected one number"),
        ({"repeats": np.nan}, "'repeats' is nan; expected one number"),
        ({"repeats": 3}, "'repeats' is 3; expected 0, or 4 to the 3000 samples"),
        ({"repeats": 99.5}, "'repeats' is 99.5; expected 0, or 4 to the 3000 samples"),
        ({"is_held": np.ones(N)}, r"'is_held' has the shape \(3000,\); expected one number"),
        ({"is_held": np.array("yes")}, "'is_held' is 'yes'; expected one number"),
        ({"kind:a": np.array("speed")}, "'kind:a' is 'speed'; expected one of receptance, mobility"),
        ({"kind:a": np.ones(N)}, r"'kind:a' has the shape \(3000,\); expected one of receptance"),
        ({"out:b": np.array(["high"] * N)}, "'out:b' holds str128; expected numbers"),
    ],
)
def test_columns_that_do_not_fit_are_named(more: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=said):
        read_table(saved(tmp_path / "run.npz", **more), "receptance")


@pytest.mark.parametrize(("rate_hz", "decimals"), [(2048.0, 6), (300.0, 5), (50_000.0, 6)])
def test_even_instants_may_be_rounded(rate_hz: float, decimals: int, tmp_path: Path) -> None:
    """Half a microsecond is more than a thousandth of a step of 488 microseconds."""
    t = np.round(np.arange(N) / rate_hz, decimals)
    records = read_table(saved(tmp_path / "run.npz", t=t), "receptance")
    assert isinstance(records, Records) and records.rate_hz == pytest.approx(rate_hz, rel=1e-5)


def test_a_clock_that_drifts_slowly_is_even(tmp_path: Path) -> None:
    t = T * (1 + 1e-7 * np.arange(N))  # in the middle 0.22 of a step off the straight line
    assert isinstance(read_table(saved(tmp_path / "run.npz", t=t), "receptance"), Records)


@pytest.mark.parametrize(
    ("t", "said"),
    [
        (np.delete(np.arange(N + 1), 1200) * 0.01, r"0\.01 to 0\.02 s, .* value 1201 \(line 1202 of a CSV\)"),
        (np.arange(N + 1)[1:] ** 1.5, "allowed is 0.1 of a step off the straight line"),
        (T[::-1], r"steps of -0.01 to -0.01 s"),
        (np.where(np.arange(N) == 7, np.nan, T), r"value 8 \(line 9 of a CSV\) is no finite number"),
        (np.zeros(N), "steps of 0 to 0 s"),
    ],
)
def test_instants_that_are_not_even_are_told_with_the_first_of_them(
    t: np.ndarray, said: str, tmp_path: Path
) -> None:
    with pytest.raises(SourceError, match=f"column 't' is not evenly spaced and ascending: .*{said}"):
        read_table(saved(tmp_path / "run.npz", t=t), "receptance")


def test_instruments_go_by_name_and_not_by_their_place(tmp_path: Path) -> None:
    more = {"in:v": T, "ref:v": 2 * T, "ref:u": 3 * T}
    records = read_table(saved(tmp_path / "run.npz", **more), "receptance")
    assert isinstance(records, Records) and list(records.instruments) == list(records.inputs) == ["u", "v"]
    assert records.instruments["v"][-1] == 2 * T[-1]


def test_what_else_a_file_holds_is_nobodys_business(tmp_path: Path) -> None:
    path = saved(tmp_path / "run.npz", operator=np.array("somebody"), calibration=np.eye(3))
    assert isinstance(read_table(path, "receptance"), Records)


def test_a_file_that_is_cut_off_is_refused_by_name(tmp_path: Path) -> None:
    whole, cut = saved(tmp_path / "whole.npz"), tmp_path / "cut.npz"
    cut.write_bytes(whole.read_bytes()[:5000])
    with pytest.raises(SourceError, match=r"cut.npz: cannot be read"):
        read_table(cut, "receptance")


def test_a_damaged_matlab_file_is_refused_before_scipy_reads_it(tmp_path: Path) -> None:
    """A type that does not exist led SciPy to memory that is not its own, which ends the process."""
    path = tmp_path / "run.mat"
    savemat(path, {"t": T, "in_u": np.ones_like(T), "out_a": np.ones_like(T)})
    assert isinstance(read_table(path, "receptance"), Records)
    content = bytearray(path.read_bytes())
    content[128] = 200  # type of the first element
    path.write_bytes(bytes(content))
    with pytest.raises(SourceError, match=r"run.mat: is damaged.* type 200"):
        read_table(path, "receptance")


@pytest.mark.parametrize("name", ["run.csv", "RUN.CSV"])
def test_a_byte_order_mark_and_capitals_are_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text("\ufefft,in:u,out:a\n0,1,2\n0.1,1,2\n0.2,1,2\n", encoding="utf-8")
    assert isinstance(read_table(path, "receptance"), Records)


def test_a_csv_as_spreadsheets_write_it_is_read(tmp_path: Path) -> None:
    """Semicolons, commas as decimal marks, an empty line at the end."""
    path = tmp_path / "run.csv"
    path.write_text("t;in:u;out:a\n0;1,5;2\n0,1;-1,25e-1;2\n0,2;1;3,5\n\n;;\n", encoding="utf-8")
    records = read_table(path, "receptance")
    assert isinstance(records, Records) and records.rate_hz == pytest.approx(10.0)
    assert records.inputs["u"].tolist() == [1.5, -0.125, 1.0]
    assert records.outputs["a"].tolist() == [2.0, 2.0, 3.5]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a/u.re,a/u.im\n1,1+5j,0\n2,1,0\n", "run.csv: 'a/u.re' holds complex numbers; expected real ones"),
        ("a/u,a/u.coherence\n1,1+5j,1j\n2,1,1\n", "'a/u.coherence' holds complex numbers"),
        ("a/u.re,a/u.im,b/u.im\n1,1,0,3\n2,1,0,3\n", "run.csv: column 'b/u.im' must end .* both parts"),
        ("a/u.im\n1,3\n2,3\n", "column 'a/u.im' must end .* both parts"),
    ],
)
def test_no_number_of_a_table_of_responses_is_passed_over(text: str, said: str, tmp_path: Path) -> None:
    """An imaginary part in a column .re, and a whole column .im without its .re, were."""
    path = tmp_path / "run.csv"
    path.write_text(f"f_hz,{text}", encoding="utf-8")
    with pytest.raises(SourceError, match=said):
        read_table(path, "receptance")


def test_complex_responses_stand_in_one_column(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("f_hz,a/u\n1,1+5j\n2,1-2j\n", encoding="utf-8")
    responses = read_table(path, "receptance")
    assert isinstance(responses, Responses) and responses.cells["a", "u"].tolist() == [1 + 5j, 1 - 2j]


@pytest.mark.parametrize("held", [0, 1])
def test_a_csv_tells_that_inputs_are_held_by_the_same_number_in_every_line(held: int, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    lines = "".join(f"{k / 10},1,2,{held}\n" for k in range(5))
    path.write_text(f"t,in:u,out:a,is_held\n{lines}", encoding="utf-8")
    records = read_table(path, "receptance")
    assert isinstance(records, Records) and records.is_held is bool(held)
    path.write_text(f"t,in:u,out:a,is_held\n{lines}0.5,1,2,{1 - held}\n", encoding="utf-8")
    with pytest.raises(SourceError, match=r"'is_held' has the shape \(6,\); expected one number"):
        read_table(path, "receptance")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,in:u,out:a\n0,1,2\n\n0.1,abc,2\n", "line 4, column 'in:u': 'abc' is not a number"),
        ("t;in:u;out:a\n0;1;2\n0,1;1;2;3\n", "line 3 has not 3 columns"),
        ("t;in:u;out:a\n0;1;2\n0,1;1.234,5;2\n", "line 3, column 'in:u': '1.234,5' is not a number"),
    ],
)
def test_what_is_no_number_is_told_with_its_line_and_column(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SourceError, match=said):
        read_table(path, "receptance")


def test_a_column_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("f_hz,a/u.re,a/u.im,a/u.re\n1,1,0,2\n2,1,0,2\n", encoding="utf-8")
    with pytest.raises(SourceError, match="more than one column is named 'a/u.re'"):
        read_table(path, "receptance")


def test_another_kind_of_file_is_refused_with_those_that_can_be_read(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=r"'.txt' is not one of .csv, .mat, .npz"):
        read_table(tmp_path / "run.txt", "receptance")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--ignore-channel", "typo"], "typo: not one of a"),
        (["--output-only", "--ignore-channel", "typo"], "typo: not one of a"),
        (["--band", "9", "3"], "expected LOW below HIGH"),
        (["--output-only", "--band", "9", "3"], "expected LOW below HIGH"),
        (["--output-only", "--band", "0", "10"], "expected a lower end above 0 Hz"),
    ],
)
def test_options_that_do_not_fit_a_file_are_refused(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["identify", str(saved(tmp_path / "run.npz")), *words]) == 2
    assert said in capsys.readouterr().err


def test_a_single_line_of_frequency_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "one.csv"
    path.write_text("f_hz,a/u.re,a/u.im\n0,1,0\n", encoding="utf-8")
    assert cli.main(["identify", str(path)]) == 2
    assert "1 line(s) of frequency" in capsys.readouterr().err
