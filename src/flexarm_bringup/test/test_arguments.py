"""What is wrong on a command line is refused before anything is computed: option, value, what is allowed."""

from __future__ import annotations

import os
from argparse import ArgumentTypeError, Namespace
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.arguments import (
    STDOUT,
    folder,
    named_file,
    new_folder,
    number,
    output_file,
    output_folder,
    overwritten_file,
    shared_file,
    whole,
)
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.whole_file import written_whole
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_file import ModelFileError, save_model
from flexarm_model.tree.reduced_tree import ReducedTree


@pytest.mark.parametrize("text", ["nan", "inf", "-0.1", "0", "1.5", "much", ""])
def test_a_number_that_is_not_allowed_is_refused_with_its_range(text: str) -> None:
    with pytest.raises(ArgumentTypeError, match=f"'{text}': expected a number, above 0, at most 1"):
        number(above=0.0, at_most=1.0)(text)


def test_numbers_within_their_range_are_taken() -> None:
    assert number(above=0.0, at_most=1.0)("1") == 1.0
    assert number()("-3e2") == -300.0
    assert whole(at_least=0)("0") == 0


@pytest.mark.parametrize("text", ["-1", "1.0", "x", "nan"])
def test_a_count_is_a_whole_number(text: str) -> None:
    with pytest.raises(ArgumentTypeError, match=f"'{text}': expected a whole number, at least 0"):
        whole(at_least=0)(text)


def test_a_file_is_tried_and_leaves_no_trace(tmp_path: Path) -> None:
    assert output_file(str(tmp_path / "new.html")) == tmp_path / "new.html"
    assert not (tmp_path / "new.html").exists()
    (tmp_path / "old.html").write_text("old")
    assert output_file(str(tmp_path / "old.html")).read_text() == "old"
    assert output_file("-") == STDOUT
    assert output_file("/dev/null") == Path("/dev/null")


@pytest.mark.parametrize("name", ["nowhere/page.html", "."])
def test_a_file_that_cannot_be_written_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ArgumentTypeError, match="cannot be written"):
        output_file(f"{tmp_path}/{name}")


def test_a_file_that_is_read_again_has_a_name(tmp_path: Path) -> None:
    assert named_file(str(tmp_path / "new.yaml")) == tmp_path / "new.yaml"
    with pytest.raises(ArgumentTypeError, match="'-': expected the name of a file"):
        named_file("-")
    os.mkfifo(tmp_path / "pipe")
    for special in ("/dev/null", str(tmp_path / "pipe")):
        with pytest.raises(ArgumentTypeError, match="not a device or a pipe"):
            named_file(special)


def test_no_file_takes_the_place_of_a_device_or_a_pipe(tmp_path: Path) -> None:
    """Root's --save /dev/full left a regular file where the system's device had been."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="is no regular file"), written_whole(tmp_path / "pipe", "text"):
        pytest.fail("it has written")
    model = linearize(ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False))
    with pytest.raises(ModelFileError, match="pipe: is no regular file"):
        save_model(model, tmp_path / "pipe")
    assert (tmp_path / "pipe").is_fifo() and list(tmp_path.iterdir()) == [tmp_path / "pipe"]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("model single_link --json a --html ./a", "--json and --html are one file, a; expected one for each"),
        ("smooth BAG --csv a --json a", "--json and --csv are one file, a"),
        ("model single_link --json - --html -", "--json and --html are one file, the standard output"),
        (
            "identify BAG --manipulator single_link --update a --retune a",
            "--update and --retune are one file",
        ),
        ("model single_link --save a --html a", "--html and --save are one file, a"),
    ],
)
def test_two_options_that_name_one_file_are_refused(
    line: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second one wrote over the first."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        cli.main(line.split())
    assert stop.value.code == UNUSABLE and said in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_reports_into_devices_and_defaults_of_one_name_are_not_one_file() -> None:
    null = Path("/dev/null")
    assert not shared_file(Namespace(json=null, html=null, update=Path(), retune=Path()))


@pytest.mark.parametrize(
    "words",
    ["model single_link --save -", "identify x.npz --update -", "identify x.npz --update a.yaml --retune -",
     "identify rig --save -"],
)  # fmt: skip
def test_no_file_is_named_like_the_standard_output(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        cli.main(words.split())
    assert ended.value.code == 2 and not (tmp_path / "-").exists()
    assert f"argument {words.split()[-2]}: '-': expected the name of a file" in capsys.readouterr().err


def test_a_folder_can_be_made_or_is_refused(tmp_path: Path) -> None:
    assert output_folder(str(tmp_path)) == tmp_path and tmp_path.is_dir()
    assert output_folder(str(tmp_path / "a" / "b")) == tmp_path / "a" / "b"
    assert not (tmp_path / "a").exists()  # who writes into it makes it
    assert new_folder(str(tmp_path / "new" / "b")) == tmp_path / "new" / "b"
    assert not (tmp_path / "new").exists()  # nor is anything left of trying
    (tmp_path / "file").write_text("")
    for refused in (output_folder, new_folder):
        with pytest.raises(ArgumentTypeError, match="cannot be made a folder"):
            refused(str(tmp_path / "file" / "b"))
    with pytest.raises(ArgumentTypeError, match="exists already"):
        new_folder(str(tmp_path))
    with pytest.raises(ArgumentTypeError, match="no such folder"):
        folder(str(tmp_path / "file"))


@pytest.mark.parametrize(
    "line",
    [
        "model single_link --html {0}/no/page.html",
        "model single_link --save {0}/no/model.json",
        "sim single_link --json {0}",
        "demo --folder {0}/file/demo",
        "margins single_link --along -1",
        "margins single_link --along 100000",
        "compare single_link --workers -3",
        "consistency --runs 0",
        "consistency --seed -1",
        "drift --simulate single_link --minutes nan",
        "drift --simulate single_link --change -150",
        "soak --minutes -1",
        "realtime --minutes -1",
        "realtime --rate nan",
        "rig --seconds -1",
        "rig --log {0}/file/log",
        "rig --bag {0}",
        "rig --bag {0}/file/bag",
        "rig --bag /proc/flexarm/bag",
        "echo modal_state --wait nan",
        "monitor --rate 0",
        "identify rig --manipulator single_link --share nan",
        "identify rig --manipulator single_link --periods 0",
        "doctor --folder {0}/no",
        "doctor --json {0}/no/file",
        "security {0}/file/keys",
        "plot {0} --png {0}/file/pictures",
    ],
)
def test_a_wrong_option_ends_with_two_and_its_name(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit) as stop:
        cli.main(line.format(tmp_path).split())
    assert stop.value.code == UNUSABLE
    error = capsys.readouterr().err
    assert "error: argument" in error
    assert error.startswith(f"usage: flexarm {line.split()[0]}")


@pytest.mark.parametrize(
    "line",
    [
        "demo no_such_arm --no-dds --folder {0}/demo",
        "model no_such_arm",
        "sim no_such_arm",
        "rig no_such_arm",
        "compare no_such_arm",
        "faults --rows 999",
        "replay {0}",
        "regress {0}",
        "recover {0} --output {0}/saved",
        "margins single_link --set mpc.input_jerk=nan",
        "plot {0}",
        "consistency no_such_arm",
        "ablate {0}",
        "tune {0}",
        "identify {0}/none.csv",
        "drift {0}",
        "security {0}/keys no_such_arm",
        "echo --once",
        "monitor no_such_arm",
        "realtime --preset no_such_preset",
        "soak no_such_arm",
        "soak --minutes 1",
        "bench --folder {0}",
    ],
)
def test_what_cannot_be_used_is_told_on_stderr_with_the_commands_name(
    line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(line.format(tmp_path).split()) == UNUSABLE
    out, err = capsys.readouterr()
    assert not out and f"\nflexarm {line.split()[0]}: " in f"\n{err}"


def test_an_unknown_option_is_answered_with_the_options_of_its_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as stop:
        cli.main(["model", "single_link", "--pse", "A"])
    assert stop.value.code == UNUSABLE
    error = capsys.readouterr().err
    assert "--pose POSE" in error
    assert "unrecognized arguments: --pse A" in error


def test_options_without_a_command_are_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        cli.main(["--html"])
    assert stop.value.code == UNUSABLE


@pytest.mark.parametrize("option", ["json", "html", "update"])
def test_what_is_read_is_not_overwritten(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A laboratory's measurement was replaced by the report about it, a description by the fitted one."""
    read, new = tmp_path / "run.csv", tmp_path / "new.json"
    read.write_text("f_hz,a/b\n1,1\n")
    new.write_text("{}")
    monkeypatch.chdir(tmp_path)
    for path in ("run.csv", str(read)):
        with pytest.raises(SystemExit) as stop:
            cli.main(["identify", path, f"--{option}", str(read)])
        assert stop.value.code == UNUSABLE
        assert f"--{option} would overwrite" in capsys.readouterr().err
    assert read.read_text() == "f_hz,a/b\n1,1\n"
    assert not overwritten_file(Namespace(json=new, html=None, files=[read], name="x" * 5000, n=3))
