"""Settings of a case, laid by node and key over those that its bag was recorded with; null takes one away."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from flexarm_bringup.regress.case import EXPECT_FILE, Case
from flexarm_model.settings.strict_yaml import ConfigError


def place_of(case: Case) -> str:
    """Return where the settings of a case stand, for messages."""
    return f"{case.folder / EXPECT_FILE}: settings"


def lay_over(recorded: Mapping[str, Mapping[str, Any]], case: Case) -> dict[str, dict[str, Any]]:
    """Return the settings with which a case is played, by node.

    Args:
        recorded: Those kept in its bag, by node.
        case: What is asked for.

    Raises:
        ConfigError: It takes away what was not recorded; a misspelt key would be that for ever.
    """
    given = json.loads(case.settings or "{}")
    settings = {node: dict(values) for node, values in recorded.items()}
    for node, values in given.items():
        known = settings.setdefault(node, {})
        for key, value in values.items():
            if value is None and key not in known:
                there = ", ".join(sorted(known)) or "none"
                allowed = f"null takes away what the bag was recorded with; of {node} that is {there}"
                raise ConfigError(f"{place_of(case)}: {node}.{key}: None: {allowed}")
        settings[node] = {key: value for key, value in {**known, **values}.items() if value is not None}
    return settings
