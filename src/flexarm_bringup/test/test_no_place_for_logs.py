"""Tools do without log files, and who needs one says in one line that it cannot be written."""

from pathlib import Path

import pytest

from flexarm_bringup.cli import main


@pytest.fixture
def no_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Name a folder for logs that cannot be made."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "file" / "log"))
    return tmp_path / "file" / "log"


@pytest.mark.ros
@pytest.mark.unhurried
@pytest.mark.parametrize("line", ["stop", "monitor --once --wait 0.1"])
def test_a_tool_needs_no_place_for_logs(line: str, no_place: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(line.split()) in (0, 2)  # nobody is there; a list of nothing is one
    said = capfd.readouterr().err
    assert "log" not in said and said.count("\n") <= 1


def test_the_rig_says_that_it_has_no_place_for_logs(
    no_place: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "229")  # a rig may run in the domain of whoever tests
    assert main(["rig"]) == 2
    said = capfd.readouterr().err
    assert said.startswith(f"flexarm rig: {no_place}") and said.endswith("ROS_LOG_DIR chooses another\n")
