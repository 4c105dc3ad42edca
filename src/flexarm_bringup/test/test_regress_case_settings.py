"""Settings of a case lie over those of its bag: what it does not say is as it was recorded."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.regress.case import Case, read_case
from flexarm_bringup.regress.pinned import Pinned
from flexarm_bringup.regress.playing import configured
from flexarm_model.settings.strict_yaml import ConfigError

RECORDED = {"controller": {"law": "mpc", "horizon": 130}, "model": {"angle": 0.05}}
UNSAID = Pinned(Path("bag"), {}, {})


def played_with(settings: str, recorded: str = json.dumps(RECORDED)) -> Any:
    """Return the settings of the nodes when a case says some."""
    bag = Bag(Path("bag"), (), {}, {"settings": recorded})
    case = Case(Path("case"), "", UNSAID, UNSAID, (), settings=settings)
    return json.loads(configured(bag, case).custom["settings"])


def test_one_setting_of_a_case_leaves_the_others_as_recorded() -> None:
    """It threw all of them away, those of other nodes, too."""
    settings = json.dumps({"controller": {"law": "pd"}, "estimator": {"gate": 3.0}})
    assert played_with(settings) == {
        "controller": {"law": "pd", "horizon": 130},
        "model": {"angle": 0.05},
        "estimator": {"gate": 3.0},
    }


@pytest.mark.parametrize("settings", ["", "{}", '{"controller": {}}'])
def test_a_case_that_says_none_has_those_of_its_bag(settings: str) -> None:
    assert played_with(settings) == RECORDED


def test_null_takes_away_what_was_recorded_and_nothing_else() -> None:
    without = {"controller": {"law": "mpc"}, "model": {"angle": 0.05}}
    assert played_with('{"controller": {"horizon": null}}') == without
    allowed = "case/expect.yaml: settings: controller.horizn: None: null takes .* that is horizon, law$"
    with pytest.raises(ConfigError, match=allowed):
        played_with('{"controller": {"horizn": null}}')
    with pytest.raises(ConfigError, match="estimator.gate: None: .* that is none$"):
        played_with('{"estimator": {"gate": null}}')


def test_settings_of_a_bag_that_are_none_are_not_hidden_by_those_of_a_case() -> None:
    with pytest.raises(BagError, match="^bag: its settings are not values by node: 'lqr'$"):
        played_with('{"controller": {"law": "pd"}}', recorded='"lqr"')


def test_a_bag_that_says_none_has_those_of_the_case() -> None:
    bag = Bag(Path("bag"), (), {}, {})
    case = Case(Path("case"), "", UNSAID, UNSAID, (), settings='{"controller": {"law": "pd"}}')
    assert json.loads(configured(bag, case).custom["settings"]) == {"controller": {"law": "pd"}}
    assert "settings" not in configured(bag, replace(case, settings="")).custom


@pytest.mark.parametrize("settings", ["lqr", ["controller"], {"controller": "lqr"}, {"controller": None}])
def test_settings_that_are_none_are_refused_with_the_file_in_which_they_stand(
    settings: object, tmp_path: Path
) -> None:
    """The bag was named instead."""
    bag = {"path": "bag", "sha256": {"data.mcap": ""}, "counts": {"/flexarm/joint_states": 2}}
    content = {"format": "flexarm-regress/1", "bag": bag, "golden": {**bag, "path": "golden"}}
    (tmp_path / "expect.yaml").write_text(yaml.safe_dump({**content, "tolerances": [], "settings": settings}))
    with pytest.raises(ConfigError) as caught:
        read_case(tmp_path)
    allowed = "expected parameters by node, as {controller: {law: pd}}"
    assert str(caught.value) == f"{tmp_path}/expect.yaml: settings: {settings!r}: {allowed}"
