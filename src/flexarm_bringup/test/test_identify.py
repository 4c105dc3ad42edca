"""``flexarm identify``: every kind of file gives the modes that were put in; bad ones are refused by name."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import pyuff
from identify_files import F_HZ, STIFFNESS, TIP_MASS, ZETA, record, softer_strip
from scipy.io import savemat

from flexarm_bringup import cli
from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.measurement import Responses, SourceError, merge
from flexarm_bringup.identify.page import _collinearity, _knowledge
from flexarm_bringup.identify.run import NEEDED_LINES, WINDOWED_LINES
from flexarm_bringup.identify.simpler_methods import half_power_beside
from flexarm_bringup.identify.sources import read_sources
from flexarm_bringup.identify.uff_source import read_uff
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.modal.frf import Frf, Ports, modal_frf
from flexarm_model.modal.modes import Modes
from flexarm_model.reading.config import load_config

LINES = np.arange(0.0, 60.0, 0.25)
OUTPUTS = ("1+z", "2+z", "3-x")


def responses() -> Frf:
    omega = 2 * np.pi * F_HZ
    modes = Modes(omega, 2 * ZETA * omega, np.array([[1.0, 0.5], [0.3, -1.0], [-0.8, 0.6]]))
    return modal_frf(LINES, modes, Ports(np.eye(3)[:, :1], np.eye(3)), "accelerance")


def cells() -> dict[str, np.ndarray]:
    return {f"{name}/1+z": responses().H[:, k, 0] for k, name in enumerate(OUTPUTS)}


def write_csv(path: Path, kind: str = "parts") -> Path:
    columns: dict[str, np.ndarray] = {"f_hz": LINES}
    for name, values in cells().items():
        parts = {f"{name}.re": values.real, f"{name}.im": values.imag}
        columns |= parts if kind == "parts" else {name: values}
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path


def write_uff(path: Path) -> Path:
    for k, name in enumerate(OUTPUTS):
        direction = {"z": 3, "x": -1}[name[-1]]
        pyuff.UFF(str(path))._write_set(
            pyuff.prepare_58(
                func_type=4, rsp_node=k + 1, rsp_dir=direction, ref_node=1, ref_dir=3,
                data=responses().H[:, k, 0], x=LINES,
                id1="frf", binary=0, ordinate_spec_data_type=12, abscissa_min=0.0, abscissa_inc=0.25,
                ord_data_type=5, abscissa_spec_data_type=18, num_pts=LINES.size, abscissa_spacing=1,
                orddenom_spec_data_type=13,
            ),
            "overwrite" if k == 0 else "add",
        )  # fmt: skip
    return path


def write_set(
    path: Path,
    func_type: int,
    node: int,
    kind: int,
    data: np.ndarray,
    per: int = 0,
    step: float | None = None,
) -> None:
    """Add a record in time at 200 Hz (1), or a response in steps of 0.25 Hz (4), of a point in z."""
    usual, axis = (1 / 200, 17) if func_type == 1 else (0.25, 18)
    step = usual if step is None else step
    pyuff.UFF(str(path))._write_set(
        pyuff.prepare_58(
            func_type=func_type, rsp_node=node, rsp_dir=3, ref_node=1, ref_dir=3, data=data,
            x=np.arange(data.size) * step, id1="hit", binary=0, ordinate_spec_data_type=kind,
            abscissa_min=0.0, abscissa_inc=step, ord_data_type=5 if np.iscomplexobj(data) else 4,
            abscissa_spec_data_type=axis, num_pts=data.size, abscissa_spacing=1, orddenom_spec_data_type=per,
        ),
        "add" if path.exists() else "overwrite",
    )  # fmt: skip


def write_mat(path: Path) -> Path:
    names = {"a__h": 0, "b__h": 1, "c__h": 2}
    savemat(path, {"f_hz": LINES, **{name: responses().H[:, k, 0] for name, k in names.items()}})
    return path


def write_npz(path: Path) -> Path:
    np.savez(path, f_hz=LINES, **cells())
    return path


def found_hz(capsys: pytest.CaptureFixture[str], tmp_path: Path, *arguments: str) -> np.ndarray:
    report = tmp_path / "report.json"
    assert cli.main(["identify", *arguments, "--json", str(report)]) == 0, capsys.readouterr().err
    rows = json.loads(report.read_text())["tables"][0]["rows"]
    return np.array([[row[1], row[3]] for row in rows])


@pytest.mark.parametrize(
    ("suffix", "write"), [(".csv", write_csv), (".uff", write_uff), (".mat", write_mat), (".npz", write_npz)]
)
def test_responses_in_every_kind_of_file_give_the_modes_put_in(tmp_path, capsys, suffix, write):
    path = write(tmp_path / f"test{suffix}")
    found = found_hz(capsys, tmp_path, str(path))
    assert found[:, 0] == pytest.approx(F_HZ, rel=1e-4)
    assert found[:, 1] == pytest.approx(100 * ZETA, rel=1e-2)


def test_every_hit_in_a_universal_file_is_a_run_of_its_own(tmp_path):
    path, rng = tmp_path / "hits.uff", np.random.default_rng(1)
    hits = rng.standard_normal((3, 2, 2048))
    for force, answer in hits:
        write_set(path, 1, 1, 13, force)
        write_set(path, 1, 2, 8, answer)
    runs = read_sources([path], "receptance", Averaging()).records
    assert len(runs) == 3
    for run, (force, answer) in zip(runs, hits, strict=True):
        assert run.inputs["1+z"] == pytest.approx(force, abs=1e-4)
        assert run.outputs["2+z"] == pytest.approx(answer, abs=1e-4)


@pytest.mark.parametrize("kind", [0, 9, 15])
def test_an_output_that_does_not_say_what_it_is_is_not_taken_for_a_displacement(tmp_path, kind):
    path, signal = tmp_path / "hits.uff", np.ones(64)
    for node, ordinate in ((1, 13), (2, kind)):
        write_set(path, 1, node, ordinate, signal)
    with pytest.raises(
        SourceError, match=rf"output 2\+z has the ordinate data type {kind}; needed is .*8 \(di"
    ):
        read_sources([path], "accelerance", Averaging())


def test_strains_are_read_as_displacements_are(tmp_path):
    path, signal = tmp_path / "hits.uff", np.random.default_rng(2).standard_normal(1024)
    for node, ordinate in ((1, 13), (2, 3), (3, 8)):
        write_set(path, 1, node, ordinate, signal)
    (run,) = read_sources([path], "accelerance", Averaging()).records
    assert run.kind == "receptance" and list(run.outputs) == ["2+z", "3+z"]


def test_a_channel_that_is_missing_in_a_run_is_told_by_its_count(tmp_path):
    path, signal = tmp_path / "hits.uff", np.ones(64)
    for node, kind in ((1, 13), (2, 8), (2, 8)):
        write_set(path, 1, node, kind, signal)
    with pytest.raises(SourceError, match=r"hits.uff: .* 1 of input 1\+z, 2 of output 2\+z; expected"):
        read_sources([path], "receptance", Averaging())


def test_a_response_that_comes_twice_in_a_universal_file_is_refused(tmp_path):
    path = tmp_path / "twice.uff"
    for gain in (1.0, 2.0):
        write_set(path, 4, 2, 12, gain * np.ones(64, complex))
    with pytest.raises(SourceError, match=r"twice.uff: the response 2\+z/1\+z comes more than once"):
        read_sources([path], "accelerance", Averaging())


def test_complex_columns_are_read_like_parts(tmp_path):
    parts = read_sources([write_csv(tmp_path / "a.csv")], "accelerance", Averaging()).responses.matrix()
    whole = read_sources([write_csv(tmp_path / "b.csv", "complex")], "accelerance", Averaging())
    assert np.array_equal(parts.H, whole.responses.matrix().H)


def test_set_ups_that_rove_make_one_matrix_and_a_missing_cell_is_named():
    ones = np.ones(4, complex)
    f_hz, nothing = np.arange(4.0), {}
    first = Responses(f_hz, {("a", "x"): ones, ("b", "x"): 2 * ones}, nothing, "mobility")
    second = Responses(f_hz, {("a", "y"): 3 * ones}, nothing, "mobility")
    together = merge([first, second])
    with pytest.raises(SourceError, match="b/y"):
        together.matrix()
    full = merge(
        [together, Responses(f_hz, {("b", "y"): 4 * ones, ("a", "x"): 3 * ones}, nothing, "mobility")]
    )
    assert full.matrix().H[0].real.tolist() == [[2.0, 3.0], [2.0, 4.0]]


@pytest.mark.slow
def test_records_give_modes_with_both_uncertainties_and_a_page(tmp_path, capsys):
    page = tmp_path / "page.html"
    path = record(tmp_path / "run.npz")
    found = found_hz(
        capsys, tmp_path, str(path), "--resolution", "0.1", "--band", "5", "45", "--html", str(page)
    )
    digital = np.arctan(np.pi * F_HZ / 200.0) * 200.0 / np.pi  # where the bilinear filter has its modes
    assert found[:, 0] == pytest.approx(digital, rel=0.003)
    text = page.read_text()
    assert "Stabilisation chart" in text and "bootstrap" in text and "<animate" in text
    assert text.count("<svg") == 5  # responses, indicator, chart, shapes, likeness


@pytest.mark.parametrize("turned", [1.0, 1j, np.exp(0.7j)])
@pytest.mark.parametrize(
    ("shape", "share"),
    [
        ([1.0, 1j], 0.0),  # a quarter of a period apart
        ([1.0, 0.995 + 0.01j, 0.99 - 0.01j], 0.9997),  # alike, but for noise of 1 %
        ([1.0, -0.5, 0.2], 1.0),
        ([1.0], 1.0),
    ],
)
def test_a_shape_is_as_real_as_its_parts_move_in_phase(shape, share, turned):
    """Whatever the phase of all together is."""
    assert _collinearity(turned * np.array(shape, complex)) == pytest.approx(share, abs=1e-4)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", "f_hz,a/h.re,a/h.im\n1,2\n", "line 2"),
        ("b.csv", "x,y\n1,2\n", "needed is 'f_hz'"),
        ("c.csv", "f_hz,a\n1,2\n", "not OUTPUT/INPUT"),
        ("d.csv", "t,out:a,in:b\n0,1,1\n1,2,2\n5,2,2\n", "evenly spaced"),
        ("e.csv", "t,out:a\n0,1\n1,2\n2,2\n", "no input"),
        ("f.uff", "not a universal file", "f.uff"),
        ("g.xyz", "", "not one of .uff"),
        ("h.mat", "no matlab", "no MATLAB file"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_with_its_name_and_the_reason(
    tmp_path, capsys, name, content, message
):
    (tmp_path / name).write_text(content)
    assert cli.main(["identify", str(tmp_path / name)]) == 2
    error = capsys.readouterr().err
    assert message in error


def test_a_missing_file_is_named(capsys):
    assert cli.main(["identify", "nowhere.csv"]) == 2
    assert "nowhere.csv: no such file" in capsys.readouterr().err


def test_one_command_brings_the_description_in_line_and_writes_it(tmp_path, capsys):
    path, new = softer_strip(tmp_path / "rig.npz"), tmp_path / "mine.yaml"
    fit = ["--manipulator", "single_link", "--preset", "geared", "--fit", STIFFNESS, "--fit", TIP_MASS,
           "--fit", "bodies.strip.damping_ratio=1"]  # fmt: skip
    assert cli.main(["identify", str(path), *fit, "--update", str(new)]) == 0, capsys.readouterr().err
    found = load_config(new, "geared")
    strip = found.bodies["strip"]
    assert isinstance(strip, Beam)
    assert pytest.approx(156.375e9, rel=0.03) == strip.pieces[0].E
    assert strip.point_masses[0].mass == pytest.approx(0.0702, rel=0.03)
    assert any(STIFFNESS in line and "sha256" in line for line in found.fitted)
    assert f"config {found.config_id}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("is_windowed", "lines", "percent", "said"),
    [
        (False, 1.2, 5.0, "known"),
        (False, 1.2, 17.7, "uncertain"),
        (False, 0.8, 5.0, "not identifiable"),
        (True, 5.0, 5.0, "not identifiable"),
    ],
)
def test_a_damping_is_known_where_its_sigma_is_well_below_it(is_windowed, lines, percent, said):
    """It was known beside a sigma of 17.7 % of it."""
    result = SimpleNamespace(needed_lines=WINDOWED_LINES if is_windowed else NEEDED_LINES)
    assert _knowledge(result, lines, 0.01, percent / 100 * 0.01) == said


@pytest.mark.parametrize(("first", "step", "word"), [(5.0, 1.0, "lines too coarse"), (12.1, 0.02, "no band")])
def test_half_power_that_cannot_be_read_is_a_word(first: float, step: float, word: str) -> None:
    omega = 2 * np.pi * F_HZ
    frf = modal_frf(
        np.arange(first, 25.0, step), Modes(omega, 2 * 0.01 * omega, np.eye(2)), Ports(np.eye(2), np.eye(2))
    )
    cells = {(name, "f"): frf.H[:, i, 0] for i, name in enumerate("ab")}
    assert half_power_beside(Responses(frf.f_hz, cells, {}, "receptance"), frf, float(F_HZ[0])) == word


def test_an_update_without_a_manipulator_is_refused(tmp_path, capsys):
    path = write_npz(tmp_path / "test.npz")
    assert cli.main(["identify", str(path), "--update", str(tmp_path / "x.yaml")]) == 2
    assert "need --manipulator NAME" in capsys.readouterr().err


def test_retuning_without_an_update_is_refused(tmp_path, capsys):
    path = write_npz(tmp_path / "test.npz")
    assert cli.main(["identify", str(path), "--manipulator", "single_link", "--retune"]) == 2
    assert "--retune needs --update" in capsys.readouterr().err


def test_a_transmissibility_is_not_taken_for_a_response_to_a_force(tmp_path: Path) -> None:
    """The ratio of two accelerations showed a zero of the second as a mode."""
    write_set(tmp_path / "ratio.uff", 4, 1, 12, np.ones(50, complex), per=12)
    with pytest.raises(SourceError, match=r"per data type 12; expected per force \(13\)"):
        read_uff(tmp_path / "ratio.uff")


def test_records_without_a_step_in_time_are_refused(tmp_path: Path) -> None:
    write_set(tmp_path / "still.uff", 1, 1, 12, np.ones(50), step=0.0)
    with pytest.raises(SourceError, match="the step in time of its records is 0 s"):
        read_uff(tmp_path / "still.uff")
