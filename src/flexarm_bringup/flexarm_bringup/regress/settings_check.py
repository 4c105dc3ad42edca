"""Are the settings of a case settings of its nodes? A misspelt one would be a default for ever."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.parameters_command import NODES, settings_of
from flexarm_bringup.regress.case import Case
from flexarm_model.settings.overrides import check_overrides
from flexarm_model.settings.parameters import ParameterError

PLAYED = ("model", "estimator", "controller")  # a recording also has those of nodes that are not


def check_settings(bag: Bag, case: Case) -> None:
    """Check nodes, keys and values of the settings of a case, or of its bag where the case says none.

    Args:
        bag: What was recorded, with its configuration, which is JSON.
        case: What is asked for.

    Raises:
        ParameterError: There is no such node or parameter, or a value is not allowed; the message names it.
    """
    if case.settings:
        _check(json.loads(case.settings), f"{case.folder}: settings")
    else:
        recorded = json.loads(bag.custom["settings"])
        known = {node: values for node, values in recorded.items() if node in PLAYED or node not in NODES}
        _check(known, f"{bag.path}: its settings")


def _check(settings: Mapping[str, Mapping[str, Any]], place: str) -> None:
    for node, given in settings.items():
        if node not in NODES:
            raise ParameterError(f"{place}: {node}: no such node; there are {', '.join(NODES)}")
        try:
            check_overrides(settings_of(node), given)
        except ParameterError as error:
            raise ParameterError(f"{place}: {node}.{error}") from None
