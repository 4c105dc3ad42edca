"""What the console scripts of this package call; see ``flexarm_model.process.executable``."""

from __future__ import annotations

from flexarm_model.process.executable import run_executable


def commander_node() -> int:
    """Lead the arm through moves."""
    return run_executable("flexarm_bringup.commander_node", ["commander"])


def composed_node() -> int:
    """Estimate and control in one process."""
    return run_executable("flexarm_bringup.processes.composed_node", ["controller", "estimator"])


def excite_node() -> int:
    """Excite the arm for a modal test."""
    return run_executable("flexarm_bringup.excite.excite_node", ["excite"])


def markers_node() -> int:
    """Show the arm."""
    return run_executable("flexarm_bringup.display.markers_node", ["markers"])


def recorder_node() -> int:
    """Record topics into a bag."""
    return run_executable("flexarm_bringup.recorder_node", ["recorder"])


def rig_node() -> int:
    """Simulate the hardware."""
    return run_executable("flexarm_bringup.rig_node", ["rig"])
