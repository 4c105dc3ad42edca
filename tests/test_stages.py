"""``./flexarm test``: which stages run, what has the processor first, and what a failure ends with."""

from __future__ import annotations

import subprocess
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import IO, Any

import pytest


@pytest.fixture
def commands(bootstrap: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Replace what stages run by a fake that is recorded; tests with nodes print a line and fail."""
    done: list[list[str]] = []

    def run(command: list[str], stdout: IO[str] | None, **_: Any) -> subprocess.CompletedProcess[str]:
        done.append(command)
        if stdout:
            stdout.write("a node did not answer\n")
        return subprocess.CompletedProcess(command, 3 if stdout else 0)

    monkeypatch.setattr(bootstrap, "STATE", tmp_path)
    monkeypatch.setattr(bootstrap, "package_hashes", dict)
    monkeypatch.setattr(bootstrap, "environment", lambda *_: {})
    monkeypatch.setattr(bootstrap.subprocess, "run", run)
    return done


def place(version: str = "3.11") -> SimpleNamespace:
    return SimpleNamespace(env=Path(f"env-{version}-abc"), python="python")


def test_what_has_no_nodes_runs_beside_those_that_have_and_yields_to_them(
    bootstrap: ModuleType, commands: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert bootstrap.run_tests(place(), []) == 1
    (nodes,) = (command for command in commands if "nice" not in command)
    assert nodes[-1] == "not slow and not long and ros and not unhurried"
    modules = [command[5] for command in commands if "nice" in command]
    assert modules == ["ruff", "ruff", "mypy", "coverage", "coverage", "pytest"]
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "a node did not answer"
    assert [line.split()[0] for line in said[1:]] == ["ok"] * 6 + ["FAILED"]


def test_quick_tests_start_no_node_and_hide_nothing_that_a_run_with_nodes_has_left(
    bootstrap: ModuleType, commands: list[list[str]], tmp_path: Path
) -> None:
    (tmp_path / "log").mkdir()
    (tmp_path / "log" / "nodes.log").write_text("of the last run")
    assert bootstrap.run_tests(place(), ["--fast"]) == 0
    assert [command[2] for command in commands] == ["ruff", "ruff", "mypy", "pytest"]
    assert "not ros" in commands[-1][commands[-1].index("-m", 2) + 1]
    assert (tmp_path / "log" / "nodes.log").read_text() == "of the last run"


def test_what_takes_longer_than_a_second_is_run_where_it_is_asked_for(
    bootstrap: ModuleType, commands: list[list[str]]
) -> None:
    bootstrap.run_tests(place(), ["--long"])
    bootstrap.run_tests(place(), ["--all"])
    marks = [word for command in commands for word in command if "unhurried" in word]
    assert len(marks) == 4
    assert not any("long" in mark for mark in marks)


def test_arguments_of_pytest_run_it_alone(bootstrap: ModuleType, commands: list[list[str]]) -> None:
    assert bootstrap.run_tests(place(), ["tests/test_links.py", "-x"]) == 0
    assert commands == [["python", "-m", "pytest", "-q", "tests/test_links.py", "-x"]]


def test_the_oldest_python_is_not_asked_for_its_types(
    bootstrap: ModuleType, commands: list[list[str]]
) -> None:
    bootstrap.run_tests(place("3.10"), ["--fast"])
    assert [command[2] for command in commands] == ["ruff", "ruff", "pytest"]
