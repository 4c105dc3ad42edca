"""Are the settings of a case settings of its nodes? A misspelt one would be a default for ever."""

from __future__ import annotations

import json

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.parameters_command import NODES, settings_of
from flexarm_bringup.regress.case import Case
from flexarm_bringup.regress.case_settings import place_of
from flexarm_model.settings.overrides import check_overrides
from flexarm_model.settings.parameters import ParameterError

PLAYED = ("model", "estimator", "controller")  # a recording also has those of nodes that are not


def check_settings(bag: Bag, case: Case) -> None:
    """Check nodes, keys and values of the settings of a case, and of its bag beneath them.

    Args:
        bag: What was recorded, with the configuration that the case is played with, which is JSON.
        case: What is asked for.

    Raises:
        ParameterError: There is no such node or parameter, or a value is not allowed; the message names it,
            and who says so.
    """
    asked = json.loads(case.settings or "{}")
    for node, values in json.loads(bag.custom["settings"]).items():
        own = asked.get(node, {})
        recorded = f"{bag.path}: its settings"
        if node not in NODES:
            place = place_of(case) if node in asked else recorded
            raise ParameterError(f"{place}: {node}: no such node; there are {', '.join(NODES)}")
        try:
            check_overrides(
                settings_of(node), {key: values[key] for key in values if node in PLAYED or key in own}
            )
        except ParameterError as error:
            place = place_of(case) if str(error).partition(":")[0] in own else recorded
            raise ParameterError(f"{place}: {node}.{error}") from None
