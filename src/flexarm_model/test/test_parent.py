"""A process that was told its parent ends with it, and one that something else has started does not."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys

import pytest

from flexarm_model.process.parent import MARK, end_with_parent

CHILD = """
import sys, time
from flexarm_model.process.parent import end_with_parent
end_with_parent()
print("waiting", flush=True)
time.sleep(60)
"""
PARENT = f"""
import os, subprocess, sys, time
named = os.getpid() if sys.argv[1] == "own" else 1
subprocess.Popen([sys.executable, "-c", {CHILD!r}], env={{**os.environ, {MARK!r}: str(named)}})
time.sleep(60)
"""


@pytest.mark.parametrize(("whose", "ends"), [("own", True), ("another", False)])
def test_a_node_ends_when_the_parent_that_was_named_is_killed(whose: str, ends: bool) -> None:
    command = [sys.executable, "-c", PARENT, whose]
    with subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True) as parent:
        assert parent.stdout is not None
        try:
            assert parent.stdout.readline() == b"waiting\n"
            parent.kill()
            parent.wait()
            assert _is_closed(parent.stdout.fileno(), 10.0 if ends else 0.5) == ends
        finally:
            if not ends:
                os.killpg(parent.pid, signal.SIGKILL)


def test_who_is_started_by_a_node_does_not_inherit_it() -> None:
    environment = {MARK: "1", "PATH": ""}
    end_with_parent(environment)
    assert environment == {"PATH": ""}


def _is_closed(pipe: int, patience: float) -> bool:
    """Tell whether all who could write into a pipe are gone within so many seconds."""
    return bool(select.select([pipe], [], [], patience)[0]) and os.read(pipe, 1) == b""
