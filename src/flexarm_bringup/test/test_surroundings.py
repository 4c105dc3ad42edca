"""What holds for nodes where the user says nothing, and what he may not say."""

from pathlib import Path

import pytest

from flexarm_bringup.processes.surroundings import check_domain, defaults
from flexarm_model.settings.strict_yaml import ConfigError


@pytest.mark.parametrize("name", ["HOME", "ROS_HOME", "ROS_LOG_DIR"])
def test_logs_go_where_the_environment_says(name: str) -> None:
    assert "ROS_LOG_DIR" not in defaults({name: "/somewhere"})


def test_logs_have_a_folder_where_the_environment_says_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HOME", raising=False)
    assert defaults({})["ROS_LOG_DIR"] == str(Path.home() / ".ros" / "log")

    def unknown() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", unknown)
    assert Path(defaults({})["ROS_LOG_DIR"]).is_absolute()


@pytest.mark.parametrize("value", ["", "0", "7", "007", "232"])
def test_a_domain_is_a_number_that_has_ports(value: str) -> None:
    check_domain({"ROS_DOMAIN_ID": value})


@pytest.mark.parametrize("value", ["abc", "233", "-1", " "])
def test_what_is_no_domain_is_refused_with_what_is_allowed(value: str) -> None:
    with pytest.raises(ConfigError, match="expected a whole number, 0 to 232"):
        check_domain({"ROS_DOMAIN_ID": value})
