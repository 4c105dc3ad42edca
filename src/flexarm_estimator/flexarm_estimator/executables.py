"""What the console scripts of this package call; see ``flexarm_model.process.executable``."""

from __future__ import annotations

from flexarm_model.process.executable import run_executable


def estimator_node() -> int:
    """Estimate joints, modes and tip."""
    return run_executable("flexarm_estimator.estimator_node", ["estimator"])


def drift_node() -> int:
    """Watch the parameters of the arm drift."""
    return run_executable("flexarm_estimator.drift_node", ["drift"])
