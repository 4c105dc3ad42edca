"""A process is shown by its title, and keeps its arguments and environment."""

import subprocess
import sys
import textwrap

PROGRAM = textwrap.dedent("""
    import os, sys
    from pathlib import Path
    from flexarm_model.process.process_title import set_process_title
    before = dict(os.environ)
    assert set_process_title(sys.argv[1])
    assert os.environ == before and len(sys.argv) == 2
    shown = Path("/proc/self/cmdline").read_bytes().rstrip(b"\\0").decode()
    print(shown, Path("/proc/self/comm").read_text())
""")


def titled(title: str) -> list[str]:
    command = [sys.executable, "-c", PROGRAM, title]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_ps_and_top_show_the_title() -> None:
    assert titled("flexarm:rig") == ["flexarm:rig", "flexarm:rig"]
    assert titled("flexarm:estimator") == ["flexarm:estimator", "flexarm:estimator"[:15]]
