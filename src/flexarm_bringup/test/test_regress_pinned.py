"""A bag of a case is pinned with all its files, also those that its description names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from bag_fixture import write_bag

from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, BagError
from flexarm_bringup.regress import pinned as pinning
from flexarm_bringup.regress.case import read_case
from flexarm_bringup.regress.pinned import is_pinned, open_pinned, pin
from flexarm_model.settings.strict_yaml import ConfigError

MATRIX = "description/meshes/link/mass.mtx"


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Return a bag that keeps a file of an imported body."""
    path = write_bag(tmp_path / "bag")
    (path / MATRIX).parent.mkdir(parents=True)
    (path / MATRIX).write_text("1.0\n")
    return path


def test_a_file_in_a_folder_of_the_bag_may_not_change(bag: Path) -> None:
    pinned = pin(check_bag(bag))
    assert sorted(pinned.sha256) == ["data.mcap", MATRIX, "metadata.yaml"]
    open_pinned(pinned)
    (bag / MATRIX).write_text("2.0\n")
    assert not is_pinned(pinned)
    with pytest.raises(BagError, match=f"{MATRIX} is not the file that expect.yaml means"):
        open_pinned(pinned)
    (bag / MATRIX).unlink()
    with pytest.raises(BagError, match=f"{MATRIX} is not the file that expect.yaml means"):
        open_pinned(pinned)


def test_a_file_that_no_pin_knows_is_refused_with_the_sum_to_add(bag: Path) -> None:
    pinned = pin(check_bag(bag))
    (bag / "description" / "more.mtx").write_text("")
    with pytest.raises(BagError, match="description/more.mtx is not among the files .* add [0-9a-f]{64}$"):
        open_pinned(pinned)


def test_only_the_checksum_of_the_bag_itself_is_no_part_of_it(bag: Path) -> None:
    (bag / "description" / CHECKSUM_FILE).write_text("of somebody else\n")
    assert f"description/{CHECKSUM_FILE}" in pin(check_bag(bag)).sha256
    assert CHECKSUM_FILE not in pin(check_bag(bag)).sha256


def test_a_bag_that_is_not_the_one_meant_is_refused_before_it_is_parsed(
    bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A parser of changed bytes raised what nobody expected, and no other case was judged."""
    pinned = pin(check_bag(bag))
    (bag / "metadata.yaml").write_text("[" * 5000)
    monkeypatch.setattr(pinning, "check_bag", lambda *_: pytest.fail("it was parsed"))
    with pytest.raises(BagError, match="metadata.yaml is not the file that expect.yaml means"):
        open_pinned(pinned)


CASE: dict[str, Any] = {
    "format": "flexarm-regress/1",
    "bag": {"path": "bag", "sha256": {"data.mcap": ""}, "counts": {"/flexarm/joint_states": 2}},
    "golden": {"path": "golden", "sha256": {"data.mcap": ""}, "counts": {"/flexarm/modal_state": 2}},
    "tolerances": [],
}


@pytest.mark.parametrize("golden", ["bag", "golden/../bag", "link", "bag/golden", "."])
def test_a_golden_bag_that_shares_a_folder_with_the_recorded_one_is_refused(
    golden: str, bag: Path, tmp_path: Path
) -> None:
    """An update wrote it over the recorded bag."""
    (tmp_path / "link").symlink_to(bag)
    content = {**CASE, "golden": {**CASE["golden"], "path": golden}}
    (tmp_path / "expect.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(ConfigError) as caught:
        read_case(tmp_path)
    assert str(caught.value).startswith(f"{tmp_path}/expect.yaml: golden.path: '{golden}': ")
    (tmp_path / "expect.yaml").write_text(yaml.safe_dump(CASE))
    read_case(tmp_path)


@pytest.mark.parametrize(
    "golden", ["../other/golden", "{tmp_path}/other/golden", "link", "inner/golden", "."]
)
def test_a_golden_bag_that_is_not_of_the_case_alone_is_refused(golden: str, tmp_path: Path) -> None:
    """An update wrote it over the bag of another case; the recorded one may lie where it likes."""
    golden = golden.format(tmp_path=tmp_path)
    case = tmp_path / "case"
    for folder in (case, case / "inner", tmp_path / "other"):
        (folder / "golden").mkdir(parents=True)
        (folder / "expect.yaml").touch()
    (case / "link").symlink_to(tmp_path / "other" / "golden")
    content = {**CASE, "bag": {**CASE["bag"], "path": "../other/bag"}}
    (case / "expect.yaml").write_text(yaml.safe_dump(content))
    read_case(case)
    content["golden"] = {**CASE["golden"], "path": golden}
    (case / "expect.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(ConfigError, match="expected a folder of this case alone, apart from") as caught:
        read_case(case)
    assert str(caught.value).startswith(f"{case}/expect.yaml: golden.path: '")  # a long one is cut
