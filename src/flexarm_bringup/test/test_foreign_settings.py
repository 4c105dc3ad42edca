"""Whose settings a bag that does not say its arm is fed with: those of the moves of the arm that is named."""

import argparse
from typing import Any

import pytest

pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.replaying import replay  # noqa: E402
from flexarm_bringup.tasks.task_for import find_task  # noqa: E402

CHOSEN = [  # named, preset: the arm that takes it, and whether its filter is that of its moves
    ("planar_3rrr", None, "geared", "corrected"),
    ("planar_3rrr", "", "", "corrected"),
    (None, None, "geared", "linear"),
    (None, "light_hub", "light_hub", "linear"),
    (str(find_task("planar_3rrr")), None, "geared", "corrected"),
]


@pytest.mark.parametrize(("named", "preset", "taken", "filter_"), CHOSEN)
def test_a_foreign_bag_is_fed_with_the_settings_of_the_moves(
    named: str | None, preset: str | None, taken: str, filter_: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was fed with the defaults of the filter and no preset, and a moves file was refused."""
    seen: dict[str, Any] = {}

    def feed(_: Any, __: Any, config: Any, settings: Any) -> Any:
        seen.update(config=config, settings=settings)
        raise ValueError("seen")

    monkeypatch.setattr(replay, "check_bag", lambda _: None)
    monkeypatch.setattr(replay, "feed_bag", feed)
    args = argparse.Namespace(bag="bag", remap=["/x:=joint_states"], manipulator=named, preset=preset)
    with pytest.raises(ValueError, match="seen"):
        replay.foreign_page(args)
    task, wanted = replay.chosen(replay.NamedArm(named or "single_link", taken))
    config = replay.load_config(replay.find_manipulator(task.manipulator), wanted)
    assert seen["config"].config_id == config.config_id
    assert seen["settings"].filter == filter_
