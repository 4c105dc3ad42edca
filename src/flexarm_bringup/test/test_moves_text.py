"""Settings put into a moves file: the one value changes, however the file is written, or it is refused."""

from __future__ import annotations

import pytest
import yaml

from flexarm_bringup.retune.moves_text import with_settings
from flexarm_model.settings.strict_yaml import ConfigError

HEAD = "manipulator: a\n"
WRITTEN = [
    "",
    "settings:\n",
    "settings: ~  # none\n",
    "settings: {}\n",
    "settings:\n  mpc:\n",
    "settings:\n  mpc:\n  estimator: {gate: 3}\n",
    "settings: {mpc: {horizon: 7, blocks: [1, 2],},}\n",
    "settings: {mpc: {horizon: 7,  # periods, not more\n  }}\n",
    "settings:\n  mpc: {horizon: 7, blocks: [1, 2, 3],  }\n",
    "settings:\n  mpc:\n    blocks: [1, 2,]\n",
    "settings:\n  mpc:\n    blocks:\n    - 1\n    - 2\n",
    "settings:\n  mpc:\n    blocks:\n      - 1\n      - 2\n    horizon: 4\n  estimator: {gate: 3}\n",
    "settings:\n  mpc:\n    horizon: 7\n    blocks:\n      - 1  # short\n",
]


@pytest.mark.parametrize("rest", WRITTEN)
def test_values_are_put_into_whatever_the_file_has(rest: str) -> None:
    before = yaml.safe_load(HEAD + rest)
    after = yaml.safe_load(with_settings(HEAD + rest, {"mpc": {"horizon": 9, "modal_energy": 2e-5}}, "a"))
    was = (before.get("settings") or {}).get("mpc") or {}
    assert after["settings"]["mpc"] == {**was, "horizon": 9, "modal_energy": 2e-5}
    others = {key: value for key, value in (before.get("settings") or {}).items() if key != "mpc"}
    assert {key: value for key, value in after["settings"].items() if key != "mpc"} == others


def test_a_value_that_another_shares_is_not_changed_for_both() -> None:
    text = HEAD + "settings: {mpc: &shared {horizon: 7}}\npreset_settings: {light: {mpc: *shared}}\n"
    with pytest.raises(
        ConfigError, match=r"'settings\.mpc\.horizon': cannot be changed as the file is written"
    ):
        with_settings(text, {"mpc": {"horizon": 9}}, "a")


def test_a_text_in_the_place_of_a_section_is_refused() -> None:
    with pytest.raises(ConfigError, match="'settings.mpc': is not a mapping"):
        with_settings(HEAD + "settings: {mpc: firm}\n", {"mpc": {"horizon": 9}}, "a")


@pytest.mark.parametrize("path", ["/home/u/arm #2/up dated.yaml", "a: b.yaml", "1e3", "yes", "[x].yaml", "é"])
def test_an_arm_of_any_name_reads_back_as_it_is(path: str) -> None:
    """What stood behind a # was cut off, and the cut name was called right."""
    assert yaml.safe_load(with_settings(HEAD, {}, path))["manipulator"] == path


@pytest.mark.parametrize("after", ["    law: mpc\n", "", "  estimator: {gate: 3}\n"])
def test_a_list_in_lines_is_replaced_as_a_whole(after: str) -> None:
    text = HEAD + "settings:\n  mpc:\n    blocks:\n      - 1\n      - 2\n" + after
    before = yaml.safe_load(text)
    before["settings"]["mpc"]["blocks"] = [4, 5, 6]
    assert yaml.safe_load(with_settings(text, {"mpc": {"blocks": (4, 5, 6)}}, "a")) == before
