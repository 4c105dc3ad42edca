"""What figures of an arm rest on: what its description assumes, what was fitted. Silence is no answer."""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_model.manipulator.description import ManipulatorConfig

NONE = ("nothing",)


def rests_on(config: ManipulatorConfig, also_assumed: Sequence[str] = ()) -> dict[str, Sequence[str]]:
    """Return the remarks that belong beside every result of an arm; "nothing" where there is none.

    Args:
        config: The arm.
        also_assumed: What is assumed beside its description.
    """
    return {"assumed": [*config.assumed, *also_assumed] or NONE, "fitted": config.fitted or NONE}
