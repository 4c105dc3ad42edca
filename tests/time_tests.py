"""Find out which tests take long, and list them in tests/thorough.txt or tests/long.txt.

    ./flexarm shell
    python tests/time_tests.py thorough    what ./flexarm test --fast leaves out
    python tests/time_tests.py long        what ./flexarm test leaves out, unless --long or --all

On demand, when --fast takes more than a minute, or all of ./flexarm test more than a quarter of an hour. It
runs the tests without nodes that may stay, then those that are left, and again: what several of them share is
made by the first that asks for it. On a busy machine some take long by chance, so the rounds are few. What
takes longer than a few seconds always is marked as slow where it is written.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
ROUNDS = 5


class Listed(NamedTuple):
    """A list of tests that a run leaves out.

    Attributes:
        path: The file.
        longest: Time of one example above which a test is listed [s].
        marks: Which tests may be listed, as ``pytest -m`` reads it.
        head: First lines of the file.
        of_examples: Only the examples that take long are listed, not the whole function.
        kept: Files whose tests are not listed, however long they take.
    """

    path: Path
    longest: float
    marks: str
    head: str
    of_examples: bool
    kept: tuple[str, ...] = ()


LISTS = {
    "thorough": Listed(
        path=ROOT / "tests" / "thorough.txt",
        longest=0.1,
        marks="not slow and not ros and not long and not thorough",
        head="# Tests of which one example takes longer than 0.1 s: ./flexarm test --fast leaves them out.\n"
        "# Written by tests/time_tests.py, which measures.\n",
        of_examples=False,
    ),
    "long": Listed(
        path=ROOT / "tests" / "long.txt",
        longest=1.0,
        marks="not slow and (not ros or unhurried) and not long",
        head="# Examples of more than 1 s: ./flexarm test leaves them out, ./flexarm test --long runs them.\n"
        "# Written by tests/time_tests.py, which measures.\n",
        of_examples=True,
        kept=("tests/test_fault_matrix.py",),  # rows are played in every run
    ),
}


def main(arguments: list[str] | None = None) -> int:
    """Measure until no test that is left takes long, a few times at most."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("list", choices=LISTS, help="which list")
    parser.add_argument("--longest", type=float, metavar="S", help="of a test that is not listed [s]")
    parser.add_argument("--add", action="store_true", help="keep the list, and add to it what takes long now")
    settings = parser.parse_args(arguments)
    listed = LISTS[settings.list]
    names = set(read(listed.path)) if settings.add else set()
    for _ in range(ROUNDS):
        write(listed, names)
        found, seconds, count = measure(listed, settings.longest or listed.longest)
        names |= found
        print(f"{count} tests in {seconds:.0f} s: {len(found)} take long", flush=True)
        if not found:
            break
    write(listed, names)
    return 0


def measure(listed: Listed, longest: float) -> tuple[set[str], float, int]:
    """Run what may be listed; return what takes longer [s], the time [s], and how many tests."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        options = ["-m", listed.marks, "-n", str(len(os.sched_getaffinity(0)))]
        options += ["--dist", "loadfile", f"--junitxml={report}", "-o", "junit_family=xunit1"]
        start = time.monotonic()
        subprocess.run([sys.executable, "-m", "pytest", "-q", *options], cwd=ROOT, check=True)
        seconds = time.monotonic() - start
        cases = list(ElementTree.parse(report).iter("testcase"))
    found = [
        f"{case.get('file')}::{case.get('name')}"
        for case in cases
        if float(case.get("time", 0)) > longest and case.get("file") not in listed.kept
    ]
    return {name if listed.of_examples else name.partition("[")[0] for name in found}, seconds, len(cases)


def read(path: Path) -> list[str]:
    """Return what a list names, "file::function" or "file::function[example]"."""
    lines = path.read_text(encoding="utf8").splitlines() if path.exists() else []
    return [line for line in lines if not line.startswith("#")]


def write(listed: Listed, names: Iterable[str]) -> None:
    """Write a list."""
    text = listed.head + "".join(f"{name}\n" for name in sorted(names))
    listed.path.write_text(text, encoding="utf8")


if __name__ == "__main__":
    sys.exit(main())
