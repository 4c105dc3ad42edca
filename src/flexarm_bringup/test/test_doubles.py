"""A graph is started once in a domain of this machine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from flexarm_bringup.processes.doubles import refuse_doubles
from flexarm_bringup.processes.graph import rig_graph
from flexarm_model.process.single_instance import NameTakenError

HOLDER = """
import sys
from flexarm_bringup.processes.doubles import refuse_doubles
from flexarm_bringup.processes.graph import rig_graph
held = refuse_doubles(rig_graph())
print("held", flush=True)
sys.stdin.read()
"""


def test_of_two_graphs_that_begin_together_only_one_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No node ran yet, so both went on; each had some of the nodes, and both ended."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", HOLDER], stdin=pipe, stdout=pipe, text=True) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == "held\n"
        with pytest.raises(NameTakenError, match="^graph /flexarm runs already in ROS domain") as error:
            refuse_doubles(rig_graph())
        assert f"(process {holder.pid})" in str(error.value)
        holder.kill()
    refuse_doubles(rig_graph()).close()
