"""Golden bag and expectations change places together; what is protected or cannot be removed is named."""

from __future__ import annotations

import os
import shutil
import stat
from pathlib import Path
from typing import Any

import pytest
from bag_fixture import write_bag

from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.regress import making
from flexarm_bringup.regress.case import Case, read_case, write_case
from flexarm_bringup.regress.pinned import is_pinned, pin
from flexarm_bringup.regress.replacing import finish_replacing, replace_golden


@pytest.fixture
def case(tmp_path: Path) -> Case:
    """Return a case whose golden bag has two instants."""
    bag, golden = (pin(check_bag(write_bag(tmp_path / name))) for name in ("bag", "golden"))
    write_case(Case(tmp_path, "", bag, golden, ()))
    return read_case(tmp_path)


def three_instants(folder: Path) -> Bag:
    """Write another bag."""
    return check_bag(write_bag(folder, 3))


def keep(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nothing be removed from the folder of that name."""
    whole = shutil.rmtree

    def refusing(path: Path, **options: Any) -> None:
        """Remove a folder, or raise as ``rmtree`` does: with the name of a file only."""
        if Path(path).name == name:
            raise PermissionError(13, "Permission denied", "sha256")
        whole(path, **options)

    monkeypatch.setattr(shutil, "rmtree", refusing)


@pytest.mark.parametrize("name", ["golden", "golden/description", "expect.yaml"])
def test_what_may_not_be_written_is_refused_before_anything_is(
    name: str, case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A write-protected golden bag was replaced, and the update said that it was left as it was."""
    (case.golden.path / "description").mkdir()
    protected = case.folder / name
    monkeypatch.setattr(os, "access", lambda path, mode: path != protected)
    with pytest.raises(PermissionError, match=f"^{protected}: may not be written$"):
        replace_golden(case, lambda _: pytest.fail("something was written"))
    assert is_pinned(case.golden)


def test_a_bag_that_cannot_be_removed_is_named_and_the_case_is_renewed(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    keep("golden.old", monkeypatch)
    left = f"{case.folder}/golden.old: cannot be removed (Permission denied)"
    assert replace_golden(case, three_instants) == left
    renewed = read_case(case.folder).golden
    assert is_pinned(renewed) and renewed.counts != case.golden.counts
    with pytest.raises(OSError) as caught:
        finish_replacing(case.folder)
    assert str(caught.value) == left
    monkeypatch.undo()
    finish_replacing(case.folder)
    assert replace_golden(case, three_instants) == ""
    assert not (case.folder / "golden.old").exists() and is_pinned(read_case(case.folder).golden)


def test_a_case_that_cannot_be_made_goes_with_its_copy_of_a_protected_bag(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The copy of a folder has the rights of the folder: nobody but root could remove it."""
    case.bag.path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    whole, made = shutil.rmtree, tmp_path / "made"

    def watched(path: Path, **options: Any) -> None:
        """Remove a folder, as its owner without other rights could."""
        assert all(p.stat().st_mode & stat.S_IWUSR for p in Path(path).rglob("*"))
        whole(path, **options)

    def refuse(*_: Any) -> None:
        """Raise what stops a case after its bag is there."""
        assert (made / "bag" / "data.mcap").exists()
        raise ValueError("no such arm")

    monkeypatch.setattr(making, "NEEDED", ())
    monkeypatch.setattr(making, "configured", refuse)
    monkeypatch.setattr(shutil, "rmtree", watched)
    with pytest.raises(ValueError, match="no such arm"):
        making.make_case(made, making.Source(case.bag.path))
    assert not made.exists()
    assert not case.bag.path.stat().st_mode & stat.S_IWUSR  # what it was made of has what rights it had
    case.bag.path.chmod(stat.S_IRWXU)
