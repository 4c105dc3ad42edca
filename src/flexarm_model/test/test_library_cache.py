"""A library left in pieces by a power cut is built anew; a folder that cannot be used costs speed only."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from flexarm_model.numeric import library_cache
from flexarm_model.numeric.compiled import compile_functions, find_compiler
from flexarm_model.numeric.library_cache import build_library

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")

CODE = "double twice(double x) { return 2 * x; }\n"
USE = """
import ctypes, sys
from pathlib import Path
from flexarm_model.numeric.library_cache import build_library
library = ctypes.CDLL(str(build_library(Path(sys.argv[1]), sys.argv[2])))
library.twice.restype, library.twice.argtypes = ctypes.c_double, [ctypes.c_double]
print(library.twice(1.5))
"""
FUNCTIONS = """
import casadi as ca
from flexarm_model.numeric.compiled import compile_functions
x = ca.SX.sym("x")
f = compile_functions({"f": ca.Function("f", [x], [2 * x])})["f"]
print(float(f(1.5)[0]), f.library is not None)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("FLEXARM_CACHE", str(tmp_path / "cache"))
    library_cache.tell.cache_clear()
    library_cache._maker.cache_clear()
    yield tmp_path / "cache"
    library_cache._maker.cache_clear()


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "twice.c"
    path.write_text(CODE)
    return path


def compiler() -> str:
    found = find_compiler()
    assert found is not None
    return found


def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A process of its own: what is tested stopped it with a signal."""
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=100)


@pytest.mark.parametrize(
    "left", ["nothing", "half", "all but a byte", "other bytes", "another file", "one bit"]
)
def test_a_damaged_library_is_built_anew(folder: Path, source: Path, left: str) -> None:
    library = build_library(source, compiler())
    assert library is not None
    whole = library.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 2] ^= 1
    library.write_bytes(
        {
            "nothing": b"", "half": whole[: len(whole) // 2], "all but a byte": whole[:-1],
            "other bytes": bytes(len(whole)), "another file": b"hello", "one bit": bytes(flipped),
        }[left]
    )  # fmt: skip
    used = run(USE, str(source), compiler())
    assert (used.returncode, used.stdout) == (0, "3.0\n"), used.stderr
    assert library.read_bytes() == whole


def test_a_damaged_library_of_functions_is_built_anew(folder: Path) -> None:
    assert run(FUNCTIONS).stdout == "3.0 True\n"
    (library,) = folder.glob("*.so")
    whole = library.read_bytes()
    library.write_bytes(whole[: len(whole) // 2])
    used = run(FUNCTIONS)
    assert (used.returncode, used.stdout) == (0, "3.0 True\n"), used.stderr
    assert library.read_bytes() == whole


def test_a_whole_library_that_does_not_open_is_built_anew(folder: Path, source: Path) -> None:
    """One that was made for another C library, say."""
    library = build_library(source, compiler())
    assert library is not None
    whole = library.read_bytes()
    library.write_bytes(b"no library" + library_cache._seal(b"no library"))
    assert build_library(source, compiler()) == library and library.read_bytes() == whole


def test_threads_may_build_the_same_at_once(folder: Path, source: Path) -> None:
    together, built = threading.Barrier(6), []

    def build() -> None:
        together.wait()
        built.append(build_library(source, compiler()))

    threads = [threading.Thread(target=build) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(built) == 6 and len(set(built)) == 1 and built[0] is not None
    assert [path.name for path in folder.iterdir()] == [built[0].name]


def test_containers_whose_processes_have_one_number_build_apart(
    folder: Path, source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two builds of one library under way at once write to different files."""
    monkeypatch.setattr(os, "getpid", lambda: 1)
    written: list[str] = []
    compile_it = subprocess.run

    def watch(command, **options):  # type: ignore[no-untyped-def]
        if "-o" in command:
            written.append(command[command.index("-o") + 1])
            if len(written) == 1:
                build_library(source, compiler())
        return compile_it(command, **options)

    monkeypatch.setattr(subprocess, "run", watch)
    assert build_library(source, compiler()) is not None
    assert len(set(written)) == 2


def test_a_folder_that_cannot_be_made_leaves_the_virtual_machine_and_one_line(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder.write_text("a file is in its place")
    import casadi as ca

    x = ca.SX.sym("x")
    with caplog.at_level(logging.WARNING, "flexarm"):
        for factor in (2.0, 4.0):
            f = compile_functions({"f": ca.Function("f", [x], [factor * x])})["f"]
            assert f.library is None and f(1.5)[0] == factor * 1.5
    (line,) = caplog.messages
    assert str(folder) in line and "slower" in line


def test_a_compiler_that_fails_is_named_once_and_leaves_nothing(
    folder: Path, source: Path, caplog: pytest.LogCaptureFixture
) -> None:
    source.write_text("no C at all")
    with caplog.at_level(logging.WARNING, "flexarm"):
        assert build_library(source, compiler()) is None and build_library(source, compiler()) is None
    (line,) = caplog.messages
    assert compiler() in line and "twice.c" in line
    assert not list(folder.iterdir())


def test_another_version_of_the_compiler_or_another_machine_is_other_code(
    folder: Path, source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wrapper = tmp_path / "gcc"

    def install(version: str) -> None:
        wrapper.write_text(
            f'#!/bin/sh\n[ "$1" = --version ] && echo {version} && exit\nexec {compiler()} "$@"\n'
        )
        wrapper.chmod(0o755)
        library_cache._maker.cache_clear()

    names = set()
    for version, machine in (("12", "x86_64"), ("13", "x86_64"), ("13", "aarch64"), ("13", "aarch64")):
        install(version)
        monkeypatch.setattr(library_cache.platform, "machine", lambda machine=machine: machine)
        names.add(build_library(source, str(wrapper)))
    assert len(names) == 3
