"""The command line: lazy, self-explaining, with meaningful exit codes."""

from __future__ import annotations

import argparse
import importlib
import os
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.exit_codes import UNUSABLE

ROOT = Path(__file__).parents[3]
LAUNCHER = {"build", "test", "run", "shell", "env", "clean"}  # of the file flexarm itself


@pytest.fixture
def echo(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    module = types.ModuleType("echo", "Says a number.")
    module.add_arguments = lambda parser: parser.add_argument("number", type=int)  # type: ignore[attr-defined]
    module.run = lambda args: args.number  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "echo", module)
    monkeypatch.setattr(
        cli, "COMMANDS", {"echo": cli.Command("echo", "say"), "gone": cli.Command("no.such", "no")}
    )
    return module


def test_exit_code_of_a_command_is_that_of_the_process(echo: types.ModuleType) -> None:
    assert cli.main(["echo", "3"]) == 3


LATER = {f"scipy.{part}" for part in ("signal", "optimize", "interpolate", "stats", "spatial", "integrate")}
LATER |= {"filterpy", "matplotlib"}


def test_no_command_loads_libraries_before_it_computes_with_them() -> None:
    """They take most of a second: ``--help`` waited for them, and a rig that only starts its nodes."""
    modules = [command.module for command in cli.COMMANDS.values()]
    code = f"import sys, {', '.join(modules)}; print(*({LATER!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_commands_that_are_not_used_are_not_imported(echo: types.ModuleType) -> None:
    assert cli.main(["echo", "0"]) == 0  # "no.such" cannot be imported


def test_help_of_a_command_is_its_docstring(
    echo: types.ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        cli.main(["echo", "--help"])
    assert stop.value.code == 0
    assert "Says a number." in capsys.readouterr().out


def test_without_a_command_the_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([]) == UNUSABLE
    out = capsys.readouterr().out
    assert "start here:" in out
    assert all(name in out for name in cli.COMMANDS)


def test_unknown_commands_are_usage_errors(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        cli.main(["fly"])
    assert stop.value.code == UNUSABLE
    assert "reproduce" in capsys.readouterr().err


EVERY_PAGE = pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))], ids=lambda p: p.name
)


@EVERY_PAGE
def test_every_command_that_a_page_names_exists(page: Path) -> None:
    named = set(re.findall(r"\./flexarm ([a-z]+)", page.read_text(encoding="utf8")))
    assert named <= LAUNCHER | set(cli.COMMANDS)


@EVERY_PAGE
def test_no_page_has_commands_typed_that_no_shell_finds(page: Path) -> None:
    """Neither the environment nor an install space has a plain ``flexarm`` on its path."""
    typed = re.findall(r"^flexarm ([a-z]+)(?: |$)", page.read_text(encoding="utf8"), re.MULTILINE)
    assert not set(typed) & set(cli.COMMANDS)


def test_readme_gives_its_commands_the_options_they_have_and_all_they_need() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf8")
    lines = re.findall(r"^\./flexarm ([a-z]+)([^#\n]*)", text, re.MULTILINE)
    for name, rest in ((name, rest) for name, rest in lines if name in cli.COMMANDS):
        parser = argparse.ArgumentParser(prog="flexarm")
        importlib.import_module(cli.COMMANDS[name].module).add_arguments(parser)
        usage = parser.format_usage()
        inner = re.sub(r"\[[^\[\]]*\]", "", usage)  # an option's own value may be left out, too
        needed = re.findall(r"--[a-z-]+", re.sub(r"\[[^\[\]]*\]", "", inner))
        written = re.findall(r"--[a-z-]+", rest)
        assert set(needed) <= set(written) <= set(re.findall(r"--[a-z-]+", usage)), (name, usage)


def test_a_reader_that_has_seen_enough_ends_a_command_without_a_word() -> None:
    read, write = os.pipe()
    os.close(read)  # as "| head" does
    command = [sys.executable, "-m", "flexarm_bringup.cli", "parameters"]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (cli.CUT_OFF, b"")


def test_interruption_is_reported_as_a_shell_does(echo: types.ModuleType) -> None:
    def interrupt(args: argparse.Namespace) -> int:
        raise KeyboardInterrupt

    echo.run = interrupt  # type: ignore[attr-defined]
    assert cli.main(["echo", "1"]) == cli.INTERRUPTED
