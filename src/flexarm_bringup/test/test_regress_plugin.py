"""The pytest plugin collects cases, tells where they diverged, and leaves other projects alone."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from bag_fixture import write_bag

pytest_plugins = ["pytester"]

PLUGIN = ("-p", "flexarm_pytest", "-p", "no:cacheprovider")
EXPECT = """\
format: flexarm-regress/1
markers: [bags]
bag: {path: bag, sha256: {data.mcap: ''}, counts: {/flexarm/joint_states: 2}}
golden: {path: golden, sha256: {data.mcap: ''}, counts: {/flexarm/modal_state: 2}}
tolerances: []
"""


@pytest.fixture
def folder(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """Run pytest with this plugin alone, whatever is installed."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makeini("[pytest]\nmarkers = bags: needs a bag\naddopts = --strict-markers\n")
    return pytester


def add_case(pytester: pytest.Pytester, text: str = EXPECT) -> None:
    case = pytester.mkdir("case")
    (case / "expect.yaml").write_text(text)
    write_bag(case / "bag")


def test_a_case_is_collected_under_its_folder_with_its_marks(folder: pytest.Pytester) -> None:
    add_case(folder)
    found = folder.runpytest_inprocess(*PLUGIN, "--collect-only", "-q", "-m", "bags")
    found.stdout.fnmatch_lines(["case/expect.yaml::case"])
    assert folder.runpytest_inprocess(*PLUGIN, "-m", "not bags").ret == pytest.ExitCode.NO_TESTS_COLLECTED


def test_an_expect_file_of_another_project_is_left_alone(folder: pytest.Pytester) -> None:
    folder.mkdir("theirs").joinpath("expect.yaml").write_text("format: theirs\n")
    assert folder.runpytest_inprocess(*PLUGIN).ret == pytest.ExitCode.NO_TESTS_COLLECTED


@pytest.mark.parametrize("text", ["", "\0\0\0", "format: flex"])
def test_an_expect_file_beside_a_bag_is_a_test_however_damaged(text: str, folder: pytest.Pytester) -> None:
    add_case(folder, text)
    found = folder.runpytest_inprocess(*PLUGIN, "--collect-only", "-q")
    found.stdout.fnmatch_lines(["case/expect.yaml::case"])


def test_a_case_whose_expectations_are_gone_is_a_test_that_fails(folder: pytest.Pytester) -> None:
    add_case(folder)
    write_bag(folder.path / "case" / "golden")
    (folder.path / "case" / "expect.yaml").unlink()
    shutil.copytree(folder.path / "case" / "bag", folder.path / "theirs" / "golden")  # no case: no bag beside
    found = folder.runpytest_inprocess(*PLUGIN)
    found.assert_outcomes(failed=1)
    found.stdout.fnmatch_lines(["*case/expect.yaml*"])


SKIPPED = ("build", "dist", "venv", "node_modules", "CVS", "_darcs", "{arch}", "some.egg", ".hidden")


def test_a_case_is_collected_whatever_its_folder_is_called(folder: pytest.Pytester) -> None:
    """Folders that pytest does not look into for their names vanished, and the others passed."""
    for name in (*SKIPPED, "gone/build"):
        write_bag(folder.path / "cases" / name / "bag")
        folder.path.joinpath("cases", name, "expect.yaml").write_text(EXPECT)
    folder.path.joinpath("cases", "gone", "build", "expect.yaml").unlink()
    write_bag(folder.path / "cases" / "gone" / "build" / "golden")
    assert collected(folder, "cases") == {*SKIPPED, "gone/build"}


def test_folders_without_a_case_and_those_left_out_are_not_looked_into(folder: pytest.Pytester) -> None:
    for name in SKIPPED:
        case = folder.mkdir(name)
        (case / "expect.yaml").write_text("format: theirs\n" if name == "build" else EXPECT)
    folder.makeconftest("collect_ignore = ['dist']\ncollect_ignore_glob = ['*.egg']\n")
    folder.path.joinpath("venv", "pyvenv.cfg").write_text("")
    found = collected(folder, "--ignore=CVS", "--ignore-glob=.hid*")
    assert found == {"node_modules", "_darcs", "{arch}"}


def collected(folder: pytest.Pytester, *options: str) -> set[str]:
    """Return the folders in which a pytest of its own finds cases, relative to the first argument."""
    found = folder.runpytest_inprocess(*PLUGIN, "--collect-only", "-q", *options)
    lines = [line.partition("::")[0] for line in found.outlines if "expect.yaml::" in line]
    return {line.removeprefix("cases/").removesuffix("/expect.yaml") for line in lines}


def test_the_plugin_brings_neither_the_package_nor_numpy_nor_ros() -> None:
    code = (
        "import os, sys; before = dict(os.environ); import flexarm_pytest; assert dict(os.environ) == before;"
        "print(sorted({name.split('.')[0] for name in sys.modules} & {'numpy', 'rclpy', 'flexarm_model', "
        "'flexarm_bringup', 'rosbags', 'yaml', 'matplotlib'}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_setup_names_the_plugin_so_that_pytest_finds_it() -> None:
    setup = (Path(__file__).parents[1] / "setup.py").read_text(encoding="utf8")
    assert '"pytest11": ["flexarm_regress = flexarm_pytest"]' in setup
    assert 'py_modules=["flexarm_pytest"]' in setup


@pytest.mark.ros
@pytest.mark.unhurried
def test_a_case_passes_or_fails_with_its_reason_and_no_traceback(folder: pytest.Pytester) -> None:
    pytest.importorskip("rclpy", reason="needs ROS")
    add_case(folder)
    golden = Path(__file__).parents[3] / "tests" / "golden" / "single_link"
    shutil.copytree(golden, folder.path / "single_link")
    folder.makeini("[pytest]\n")
    result = folder.runpytest_subprocess(*PLUGIN)  # NumPy cannot be loaded twice in one process
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*cannot be judged: *data.mcap is not the file that expect.yaml means*"])
    result.stdout.no_fnmatch_line("*Traceback*")
