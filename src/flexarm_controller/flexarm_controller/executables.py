"""What the console scripts of this package call; see ``flexarm_model.process.executable``."""

from __future__ import annotations

from flexarm_model.process.executable import run_executable


def controller_node() -> int:
    """Follow references."""
    return run_executable("flexarm_controller.controller_node", ["controller"])


def guard_node() -> int:
    """Stand between controller and drives."""
    return run_executable("flexarm_controller.guard_node", ["guard"])
