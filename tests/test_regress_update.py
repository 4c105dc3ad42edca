"""An update of cases renews a case whole or not at all, and says which it renewed."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from planted_changes import PLANTED  # noqa: E402

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.regress import replacing  # noqa: E402
from flexarm_bringup.regress.case import EXPECT_FILE, read_case, write_case  # noqa: E402
from flexarm_bringup.regress.pinned import open_pinned  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link"
TIP = "/flexarm/end_effector"
DUMPED = ("bag", EXPECT_FILE, "golden")


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a case of which today's code makes something else."""
    PLANTED["a weight"].plant(monkeypatch)
    return Path(shutil.copytree(GOLDEN, tmp_path / "cases" / "b_case"))


def content(case: Path) -> dict[str, bytes]:
    """Return every file of a case."""
    return {str(p.relative_to(case)): p.read_bytes() for p in sorted(case.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("step", ["write_case", "replace", pytest.param("rename", marks=pytest.mark.slow)])
def test_an_update_that_fails_leaves_the_case_as_it_was(
    step: str, case: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before, whole = content(case), Path.rename

    def full(*args: Any) -> None:
        raise OSError(28, "No space left on device")

    def half(self: Path, target: Path) -> Path:
        if self.name == "golden.new":
            full()
        return whole(self, target)

    if step == "write_case":
        monkeypatch.setattr(replacing, step, full)
    else:
        monkeypatch.setattr(Path, step, half if step == "rename" else full)
    assert cli.main(["regress", str(case), "--update"]) == 2
    said = capsys.readouterr()
    assert "0 cases renewed" in said.out and "left as it was: " in said.out
    assert "No space left on device" in said.err
    assert content(case) == before
    assert sorted(path.name for path in case.iterdir()) == sorted(DUMPED)


@pytest.mark.parametrize("is_past_it", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_an_update_that_was_killed_is_no_obstacle_to_the_next(
    is_past_it: bool, case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before or after the new expectations were in their place; the other bag lies beside in either case."""
    shutil.copytree(case / "golden", case / "golden.new")  # of a third one
    shutil.copytree(case / "golden", case / "golden.old")
    other = case / ("golden.old" if is_past_it else "golden") / "data.mcap"
    other.write_bytes(other.read_bytes()[:-1])
    assert cli.main(["regress", str(case), "--update"]) == 0
    open_pinned(read_case(case).golden)
    assert sorted(path.name for path in case.iterdir()) == sorted(DUMPED)
    assert cli.main(["regress", str(case)]) == 0


def test_one_case_that_cannot_be_renewed_does_not_keep_the_others(
    case: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = Path(shutil.copytree(case, case.parent / "a_broken"))
    (broken / "bag" / "metadata.yaml").unlink()
    assert cli.main(["regress", str(case.parent), "--update"]) == 2
    said = capsys.readouterr().out
    assert "1 cases renewed" in said and "a_broken" in said and "left as it was: " in said
    assert cli.main(["regress", str(case)]) == 0


def test_expectations_under_another_name_are_the_same(case: Path) -> None:
    write_case(read_case(case), "draft.yaml")
    assert yaml.safe_load((case / "draft.yaml").read_text()) == yaml.safe_load(
        (case / EXPECT_FILE).read_text()
    )


def test_an_update_says_which_topic_went(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    PLANTED["a lost topic"].plant(monkeypatch)
    case = shutil.copytree(GOLDEN, tmp_path / "case")
    count = read_case(case).golden.counts[TIP]
    assert cli.main(["regress", str(case), "--update"]) == 0
    said = capsys.readouterr().out
    assert "as before" not in said and f"messages of {TIP} came or went" in said
    (row,) = (line.split() for line in said.splitlines() if f"{TIP}  1 message(s) missing" in line)
    assert row[-3:] == [str(count), str(count), "0"]


@pytest.mark.parametrize(
    "change",
    [
        "looser",
        pytest.param("one more ignored", marks=pytest.mark.slow),
        pytest.param("not told", marks=pytest.mark.slow),
    ],
)
def test_a_tolerance_that_was_changed_is_refused_until_it_is_accepted(
    change: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = Path(shutil.copytree(GOLDEN, tmp_path / "case"))
    expected = yaml.safe_load((case / EXPECT_FILE).read_text())
    if change == "looser":
        expected["tolerances"][-1]["atol"] *= 10.0
    elif change == "one more ignored":
        expected["tolerances"].insert(0, {"field": "joint_commands.names", "ignored": True})
    else:
        del expected["tolerances_sha256"]
    (case / EXPECT_FILE).write_text(yaml.safe_dump(expected, sort_keys=False))
    assert cli.main(["regress", str(case)]) == 2
    assert "tolerances: not those that golden/ was reviewed with; --update accepts them" in (
        capsys.readouterr().err
    )
    assert cli.main(["regress", str(case), "--update"]) == 0
    assert "changed tolerances accepted" in capsys.readouterr().out
    assert cli.main(["regress", str(case)]) == 0
