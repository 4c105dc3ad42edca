"""Editing a description in place: only the value changes, and what is written is read back."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from arms import SINGLE_LINK

from flexarm_model.identification import yaml_edit
from flexarm_model.identification.yaml_edit import add_items, edit_names, edit_values
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

TEXT = SINGLE_LINK.read_text()
STIFFNESS, MASS = "bodies.strip.pieces.0.youngs_modulus", "bodies.strip.point_masses.0.mass"


def test_only_the_lines_of_the_values_change() -> None:
    edited = edit_values(TEXT, {STIFFNESS: "156.4 GPa", MASS: "70 g"})
    changed = [
        (old, new) for old, new in zip(TEXT.splitlines(), edited.splitlines(), strict=True) if old != new
    ]
    assert len(changed) == 2
    assert all("156.4 GPa" in new or "70 g" in new for _, new in changed)


def test_a_value_within_what_a_preset_overlays_is_changed_there() -> None:
    """It was changed in the body of the file, where the preset hides it: the fit was written to nothing."""
    text = "spring: {values: [1 N, 2 N]}\npresets:\n  soft: {spring.values: [3 N, 4 N]}\n"
    assert edit_values(text, {"spring.values.1": "5 N"}, "soft").endswith("{spring.values: [3 N, 5 N]}\n")
    assert edit_values(text, {"spring.values.1": "5 N"}).startswith("spring: {values: [1 N, 5 N]}\n")


def test_a_value_that_a_preset_overlays_is_changed_there(tmp_path) -> None:
    inertia = "joints.base.axes.rz.rotor_inertia"
    path = tmp_path / "arm.yaml"
    path.write_text(edit_values(TEXT, {inertia: "0.02 kg m^2"}, "light_hub"))
    assert load_config(path, "light_hub").actuated["base.rz"].rotor_inertia == 0.02
    assert load_config(path, "geared").actuated["base.rz"].rotor_inertia == 0.30


def test_items_join_the_list_with_its_old_ones(tmp_path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(add_items(TEXT, "fitted", ['E: 156 GPa "now"', "damping"]))
    fitted = load_config(path).fitted
    assert fitted[:-2] == load_config(SINGLE_LINK).fitted
    assert fitted[-2:] == ('E: 156 GPa "now"', "damping")


def test_a_missing_list_is_made() -> None:
    assert yaml.safe_load(add_items("a: 1\n", "fitted", ["x"])) == {"a": 1, "fitted": ["x"]}


LISTS = [
    "a: 1\nfitted:\n  - old\n    text\nb: 2\n",
    "a: 1\nfitted:\n- old\nb: 2\n",
    "fitted:\n      - old\n",
    "fitted:\n  - old",
    "fitted:\n- old  # why",
    "fitted: []\nb: 2",
    "fitted:\nb: 2\n",
    "fitted:",
    "fitted: ~ # none\n",
    "fitted: [old, 'b, c',]  # why\nb: 2\n",
    "fitted:\n  - |\n    old\n\n    text\nb: 2\n",
    "fitted: [\n  old,\n]\n",
    "fitted:\n  -\n    old\n",
    "fitted:\n  # first\n  - old\n  # last\nb: 1\n",
    "a: 1",
]


@pytest.mark.parametrize("before", LISTS)
def test_items_join_a_list_however_it_is_written(before: str) -> None:
    was = yaml.safe_load(before)
    new = ['E: 156 GPa "now"', "[a, b] # {c}", "- x"]
    for _ in range(2):
        is_now = yaml.safe_load(before := add_items(before, "fitted", new))
        assert is_now == {**was, "fitted": [*(was.get("fitted") or []), *new]}
        was = is_now


@pytest.mark.parametrize("text", ["fitted: a text\n", "fitted: {a: 1}\n", "fitted: 5\n"])
def test_items_join_nothing_but_a_list(text: str) -> None:
    with pytest.raises(ConfigError, match="'fitted': is not a list"):
        add_items(text, "fitted", ["x"])


def test_a_list_that_cannot_be_added_to_is_refused() -> None:
    with pytest.raises(ConfigError, match="'fitted': cannot be added to"):
        add_items("{a: 1}\n", "fitted", ["x"])


@pytest.mark.parametrize(
    "before", ["a: 1\n...\n", "---\na: 1  # why\n# the end\n... # really\n", "a: 1\n..."]
)
def test_items_stand_before_the_mark_that_ends_a_document(before: str) -> None:
    added = add_items(before, "fitted", ["x"])
    assert yaml.safe_load(added) == {"a": 1, "fitted": ["x"]}
    assert added.endswith(before[before.index("\n...") + 1 :])


WRITTEN = [
    "200 g",
    "'200 g'",
    ">\n      200 g",
    "|\n      200\n      g",
    ">-  # heavy\n\n      200 g\n",
    "!!str 200 g",
]


@pytest.mark.parametrize("value", WRITTEN)
@pytest.mark.parametrize("rest", ["", "\n", "\n    at: 1 m\n", "\n  # another\n  - mass: 1 g\nb: 2\n"])
def test_a_value_is_changed_however_it_is_written(value: str, rest: str) -> None:
    """Of a block scalar the line break and the next line's indent were taken for a part of it."""
    before = f"masses:\n  - name: tool\n    mass: {value}{rest}"
    expected = yaml.safe_load(before)
    expected["masses"][0]["mass"] = "250 g"
    edited = edit_values(before, {"masses.0.mass": "250 g"})
    assert yaml.safe_load(edited) == expected and edited.endswith(rest)


@pytest.mark.parametrize("text", ["a: ? b\n", "a: &a 1 m\nb: *a\n"])
def test_a_text_that_says_something_else_than_asked_is_refused(
    text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(yaml_edit, "_replaced", lambda text, node, value: text)
    with pytest.raises(ConfigError, match="a: cannot be changed as the file is written"):
        edit_values("a: 1 m\nb: 2\n", {"a": "2 m"})


@pytest.mark.parametrize("style", ["a.mtx", ">-\n        a.mtx", "'a.mtx'"])
def test_names_of_files_are_changed_however_they_are_written(style: str) -> None:
    text = f"bodies:\n  solid:\n    mass:\n      file: {style}\n    nodes: 1\n"
    renamed = yaml.safe_load(edit_names(text, ["file"], lambda name: f"../{name}"))
    assert renamed == {"bodies": {"solid": {"mass": {"file": "../a.mtx"}, "nodes": 1}}}


def test_a_value_is_not_changed_twice() -> None:
    with pytest.raises(ConfigError, match="twice"):
        edit_values("a: [1, 2]\n", {"a.1": 3, "a.01": 4})


SHARED = """# two legs
half: &half {length: 18 mm, rigid: true}  # a half
legs:
  one: &leg               # the first
    ratio: &ratio 0.01    # guessed
    pieces:
      - *half
      - {length: &long 100 mm, E: 70 GPa}
  two: *leg               # as the first
  three: {ratio: *ratio, pieces: [*half, {length: *long}]}
"""


def test_a_value_behind_an_alias_is_changed_where_it_is_asked_for_alone() -> None:
    """Two changes of one shared value were both written over it: 0.0123 and 0.0123 made 0.012323."""
    changes = {"legs.one.ratio": 0.0123, "legs.two.ratio": 0.0123, "legs.two.pieces.0.length": "1 mm"}
    edited = edit_values(SHARED, changes)
    expected = json.loads(json.dumps(yaml.safe_load(SHARED)))  # without what is shared
    expected["legs"]["one"]["ratio"] = expected["legs"]["two"]["ratio"] = 0.0123
    expected["legs"]["two"]["pieces"][0]["length"] = "1 mm"
    assert yaml.safe_load(edited) == expected
    assert all(comment in edited for comment in ("# two legs", "# a half", "# the first", "# as the first"))
    assert "pieces: [*half, {length: *long}]" in edited  # what stays equal stays shared


def test_a_value_behind_an_anchor_is_changed_there_alone() -> None:
    edited = yaml.safe_load(edit_values(SHARED, {"half.length": "1 mm", "legs.one.pieces.1.length": "2 mm"}))
    assert edited["half"]["length"] == "1 mm" and edited["legs"]["one"]["pieces"][1]["length"] == "2 mm"
    for leg in ("one", "two", "three"):
        assert edited["legs"][leg]["pieces"][0]["length"] == "18 mm"
    for leg in ("two", "three"):
        assert edited["legs"][leg]["pieces"][1]["length"] == "100 mm"


def test_a_text_without_aliases_of_the_value_stays_as_it_is() -> None:
    edited = edit_values(SHARED, {"legs.three.ratio": 0.02})
    assert edited == SHARED.replace("three: {ratio: *ratio", "three: {ratio: 0.02")


def test_parts_that_a_shipped_arm_shares_are_changed_one_by_one(tmp_path: Path) -> None:
    source = SINGLE_LINK.with_name("planar_3rrr.yaml")
    values = {f"bodies.first_{k}.pieces.1.youngs_modulus": f"{70 + k}.5 GPa" for k in (1, 2, 3)}
    (path := tmp_path / "arm.yaml").write_text(edit_values(source.read_text(), values))
    for config in (load_config(path), load_config(source, changes=values)):
        assert [config.bodies[f"first_{k}"].pieces[1].E for k in (1, 2, 3)] == [71.5e9, 72.5e9, 73.5e9]


def test_a_new_description_has_another_identity(tmp_path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(edit_values(TEXT, {STIFFNESS: "156.4 GPa"}))
    assert load_config(path).config_id != load_config(SINGLE_LINK).config_id


@pytest.mark.parametrize("path", ["bodies.strip", "bodies.strip.nothing", "bodies.strip.pieces.7.density"])
def test_a_path_to_no_value_is_refused(path: str) -> None:
    with pytest.raises(ConfigError, match="no such value"):
        edit_values(TEXT, {path: "1"})
