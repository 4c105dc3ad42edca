"""Find out which tests take long, and list them in tests/thorough.txt: ./flexarm test --fast leaves them out.

    ./flexarm shell
    python tests/time_tests.py

On demand, when --fast takes more than a minute. It runs all tests that need no nodes, then those that are
left, and again: what several of them share is made by the first that asks for it. On a busy machine some take
long by chance, so the rounds are few.
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
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
LIST = ROOT / "tests" / "thorough.txt"
LONGEST = 0.1  # s, of one example of a quick test on a usual machine
ROUNDS = 5
HEAD = f"""\
# Tests of which one example takes longer than {LONGEST} s: ./flexarm test --fast leaves them out.
# Written by tests/time_tests.py, which measures.
"""


def main(arguments: list[str] | None = None) -> int:
    """Measure until no test that is left takes long, a few times at most."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--longest", type=float, default=LONGEST, metavar="S", help="of a quick test [s]")
    parser.add_argument("--add", action="store_true", help="keep the list, and add to it what takes long now")
    settings = parser.parse_args(arguments)
    thorough = set(read(LIST)) if settings.add else set()
    for _ in range(ROUNDS):
        write(LIST, thorough)
        found, seconds, count = measure(settings.longest)
        thorough |= found
        print(f"{count} tests in {seconds:.0f} s: {len(found)} functions take long", flush=True)
        if not found:
            break
    write(LIST, thorough)
    return 0


def measure(longest: float) -> tuple[set[str], float, int]:
    """Run what --fast would; return the functions that take longer [s], the time [s], and how many tests."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        options = ["-m", "not slow and not ros and not thorough", "-n", str(len(os.sched_getaffinity(0)))]
        options += ["--dist", "loadfile", f"--junitxml={report}", "-o", "junit_family=xunit1"]
        start = time.monotonic()
        subprocess.run([sys.executable, "-m", "pytest", "-q", *options], cwd=ROOT, check=True)
        seconds = time.monotonic() - start
        cases = list(ElementTree.parse(report).iter("testcase"))
    found = {f"{case.get('file')}::{name_of(case)}" for case in cases if float(case.get("time", 0)) > longest}
    return found, seconds, len(cases)


def name_of(case: ElementTree.Element) -> str:
    """Return the function of an example."""
    return case.get("name", "").partition("[")[0]


def read(path: Path) -> list[str]:
    """Return the functions that a list names, "file::function"."""
    lines = path.read_text(encoding="utf8").splitlines() if path.exists() else []
    return [line for line in lines if not line.startswith("#")]


def write(path: Path, functions: Iterable[str]) -> None:
    """Write a list."""
    path.write_text(HEAD + "".join(f"{name}\n" for name in sorted(functions)), encoding="utf8")


if __name__ == "__main__":
    sys.exit(main())
