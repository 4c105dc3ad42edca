"""A name is held by one process, in one domain, until that process lets go."""

from pathlib import Path

import pytest

from flexarm_model.single_instance import NameTakenError, claim_name


def test_a_name_is_taken_once_and_free_again_when_it_is_let_go(tmp_path: Path) -> None:
    with (
        claim_name("/flexarm/rig", "0", tmp_path / "new"),
        pytest.raises(NameTakenError, match="node /flexarm/rig runs already in ROS domain 0"),
    ):
        claim_name("/flexarm/rig", "0", tmp_path / "new")
    claim_name("/flexarm/rig", "0", tmp_path / "new").close()


def test_other_names_and_domains_are_free(tmp_path: Path) -> None:
    with claim_name("/flexarm/rig", "0", tmp_path):
        claim_name("/flexarm/rig", "1", tmp_path).close()
        claim_name("/rig", "0", tmp_path).close()
