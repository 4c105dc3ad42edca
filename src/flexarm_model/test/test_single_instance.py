"""A name is held by one process, in one domain, until that process lets go."""

import subprocess
import sys
from pathlib import Path

import pytest

from flexarm_model.process.single_instance import NameTakenError, claim_name

HOLDER = """
import sys
from pathlib import Path
from flexarm_model.process.single_instance import claim_name
held = claim_name("/flexarm/rig", "0", Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.read()
"""


def test_a_name_is_taken_once_and_free_again_when_its_process_has_ended(tmp_path: Path) -> None:
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", HOLDER, str(tmp_path / "new")]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == "held\n"
        with pytest.raises(NameTakenError, match="node /flexarm/rig runs already in ROS domain 0") as error:
            claim_name("/flexarm/rig", "0", tmp_path / "new")
        assert f"(process {holder.pid})" in str(error.value)
        holder.kill()
    claim_name("/flexarm/rig", "0", tmp_path / "new").close()


def test_a_process_that_claims_its_name_again_is_given_what_it_holds(tmp_path: Path) -> None:
    with claim_name("/flexarm/rig", "0", tmp_path) as held:
        assert claim_name("/flexarm/rig", "0", tmp_path) is held
    with claim_name("/flexarm/rig", "0", tmp_path) as again:
        assert again is not held and not again.closed


def test_other_names_and_domains_are_free(tmp_path: Path) -> None:
    with claim_name("/flexarm/rig", "0", tmp_path):
        claim_name("/flexarm/rig", "1", tmp_path).close()
        claim_name("/rig", "0", tmp_path).close()
