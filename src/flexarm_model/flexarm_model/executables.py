"""What the console scripts of this package call; see ``executable``."""

from __future__ import annotations

from flexarm_model.process.executable import run_executable


def model_node() -> int:
    """Serve reduced models."""
    return run_executable("flexarm_model.model_node", ["model"])
