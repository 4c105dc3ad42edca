"""A rig that is asked to end while it starts: no bag is missed, and none is in the way afterwards."""

from pathlib import Path

import pytest

from flexarm_bringup.rig_run.command import ENDED, OK, _judge_bag

INTERRUPTED, FAILED = -2, 1


def judged(ended: int, bag: Path | None) -> tuple[int, str]:
    said: list[str] = []
    return _judge_bag(ended, bag, said.append), " ".join(said)


@pytest.mark.parametrize("ended", [OK, INTERRUPTED])
def test_a_rig_without_a_bag_misses_none(ended: int) -> None:
    assert judged(ended, None) == (OK, "")


def test_a_recorder_that_had_not_begun_leaves_nothing_and_is_no_failure(tmp_path: Path) -> None:
    """The exit code was 1, and the advice was to recover a bag that there was not."""
    bag = tmp_path / "bag"
    assert judged(INTERRUPTED, bag) == (OK, "nothing was recorded yet")
    bag.mkdir()
    for name in ("data.mcap", "custom.json"):
        (bag / name).touch()
    assert judged(INTERRUPTED, bag) == (OK, "nothing was recorded yet")
    assert not bag.exists()


def test_what_else_is_in_the_folder_stays(tmp_path: Path) -> None:
    for name in ("data.mcap", "thesis.tex"):
        (tmp_path / name).touch()
    judged(INTERRUPTED, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_bag_that_has_begun_or_could_not_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "data.mcap").write_bytes(b"x")
    told = f"the bag is not whole; to save what is: flexarm recover {tmp_path} --output NEW"
    assert judged(INTERRUPTED, tmp_path) == (ENDED, told)
    assert judged(FAILED, tmp_path / "none")[0] == ENDED
    assert (tmp_path / "data.mcap").exists()
