"""Marks of a case: one that cannot be given fails the case and nothing else; none lets a broken case pass."""

from __future__ import annotations

from pathlib import Path

import pytest
from bag_fixture import write_bag

import flexarm_pytest
from flexarm_bringup.regress import case, finding

pytest_plugins = ["pytester"]

PLUGIN = ("-p", "flexarm_pytest", "-p", "no:cacheprovider")
EXPECT = """\
format: flexarm-regress/1
markers: [{mark}]
bag: {{path: bag, sha256: {{data.mcap: ''}}, counts: {{/flexarm/joint_states: 2}}}}
golden: {{path: golden, sha256: {{data.mcap: ''}}, counts: {{/flexarm/modal_state: 2}}}}
tolerances: []
"""


@pytest.fixture
def folder(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """Run pytest with this plugin alone, whatever is installed, beside a test of another project."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makepyfile(test_theirs="def test_theirs(): pass")
    return pytester


def add_case(pytester: pytest.Pytester, text: str) -> Path:
    path = pytester.mkdir("case")
    (path / "expect.yaml").write_text(text)
    write_bag(path / "bag")
    return path


@pytest.mark.ros
@pytest.mark.unhurried
@pytest.mark.parametrize(
    "mark", ["''", *(pytest.param(m, marks=pytest.mark.slow) for m in ("_x", "skip", "skipif", "xfail"))]
)
def test_a_mark_that_no_case_can_have_fails_it_and_leaves_the_other_tests_alone(
    mark: str, folder: pytest.Pytester
) -> None:
    pytest.importorskip("rclpy", reason="needs ROS")
    add_case(folder, EXPECT.format(mark=mark))
    result = folder.runpytest_subprocess(*PLUGIN)  # NumPy cannot be loaded twice in one process
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["*cannot be judged: *is no mark of a case, nor are skip, skipif, xfail*"])


@pytest.mark.parametrize(
    "text",
    ["about: 2020-13-45\n", "about: !!int ''\n", "about: " + 2000 * "[" + 2000 * "]" + "\n"],
    ids=["no date", "no digits", "nested too deeply"],
)
def test_a_file_that_yaml_stumbles_over_is_a_test_and_leaves_the_others_alone(
    text: str, folder: pytest.Pytester
) -> None:
    add_case(folder, EXPECT.format(mark="slow") + text)
    found = folder.runpytest_inprocess(*PLUGIN, "--collect-only", "-q")
    found.stdout.fnmatch_lines(["case/expect.yaml::case", "test_theirs.py::test_theirs"])


def test_a_format_behind_a_long_licence_is_found(folder: pytest.Pytester) -> None:
    licence = "# a line of a licence that somebody puts into every file\n" * 100
    add_case(folder, licence + EXPECT.format(mark="slow"))
    found = folder.runpytest_inprocess(*PLUGIN, "--collect-only", "-q", "-m", "slow")
    found.stdout.fnmatch_lines(["case/expect.yaml::case"])


def test_plugin_and_command_know_the_same_marks_and_format() -> None:
    assert flexarm_pytest.HIDING == case.HIDING
    assert flexarm_pytest.EXPECT_FILE == case.EXPECT_FILE
    assert flexarm_pytest.FORMAT == finding.OURS
    assert flexarm_pytest.BAGS == (case.BAG, case.GOLDEN)
