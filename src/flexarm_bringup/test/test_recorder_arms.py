"""What the recorder keeps of an arm of the user's: its name, its description, the files that this names."""

import signal
from pathlib import Path

import pytest
from imported_arm import write_arm

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")

from test_recorder_node import record  # noqa: E402

from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_bringup.bags.configuration import configuration  # noqa: E402


@pytest.mark.parametrize("is_absolute", [False, True])
def test_an_arm_given_by_its_file_is_told_from_the_bag_alone(
    is_absolute: bool, ros_environment: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = write_arm(tmp_path / "arms" / "my_arm.yaml", "meshes/")
    given = path if is_absolute else path.relative_to(tmp_path)
    options = (f"manipulator:={given}", "preset:=''", "lockstep:=true")
    code, said = record(ros_environment, tmp_path / "bag", signal.SIGINT, *options)
    assert code == 0, said
    path.rename(tmp_path / "elsewhere.yaml")
    bag = check_bag(tmp_path / "bag")
    assert bag.custom["manipulator"] == "my_arm"
    assert configuration(bag)[0].name == "solid"
    assert sorted(item.name for item in (tmp_path / "arms").iterdir()) == ["meshes"]
