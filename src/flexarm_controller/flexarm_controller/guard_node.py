"""Guard node: stands between the controller and the drives; nothing else reaches the motors.

Publishes
    applied_effort (sensor_msgs/JointState): torque [N m] or force [N] of every axis from the stamp on, once a
        motor period; ``header.frame_id`` is the seal without which the drives do not obey (``drives.seal``).
    guard_status (flexarm_interfaces/GuardStatus): 10 Hz and on change.
    ~/ready (std_msgs/Bool, latched): true once the drives obey this guard.
Subscribes
    drive_states (sensor_msgs/JointState): position and velocity as the drives measure them for themselves.
    strain (flexarm_interfaces/StrainArray), model (flexarm_interfaces/ReducedModel, latched).
    joint_commands (flexarm_interfaces/JointCommand), controller/margins (std_msgs/String, latched).
    stop (std_msgs/Empty): latches a stop.
    rig/attached (std_msgs/String, latched): fingerprint of the guard that the drives obey; empty for none.
    tick (flexarm_interfaces/Tick, lockstep only).
Services
    ~/arm, ~/stop (std_srvs/Trigger): let commands pass, unless the controller's margins are too small; stop.
Calls
    rig/attach (std_srvs/Trigger): the answer is the secret of the seal; one guard at a time has it.

It starts stopped, whatever was before. In real time it answers the drives once a period: as soon as the
command for their newest state is there, else when ``patience`` of the period has passed, and also when the
drives say nothing. In lockstep it answers every command, and while the arm comes to rest every tick.
"""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.node import Node

from flexarm_controller.guard_settings import GuardSettings
from flexarm_model.node import ReadyFlag, declare_configs, run_node
from flexarm_model.parameters import parameter


@dataclass(frozen=True)
class GuardNodeSettings:
    """Settings of the guard node beside those of the guard."""

    manipulator: str = parameter("single_link", "Name of a manipulator that comes along, or a YAML file.")
    preset: str = parameter("geared", "Preset of that file; empty for none.")
    start: tuple[float, ...] = parameter((), "Axes at the start; empty: home.", "rad or m")
    lockstep: bool = parameter(False, "Wait for the ticks of the simulated rig.")
    patience: float = parameter(
        0.7, "Share of a period after which a state is answered without a command for it.", "1", 0.1, 0.9
    )
    realtime_priority: int = parameter(
        0,
        "SCHED_FIFO priority while running, where the user may; 0 leaves it ordinary.",
        minimum=0,
        maximum=90,
    )


class GuardNode(Node):
    """Connects a ``Guard`` to topics."""

    SETTINGS = (GuardNodeSettings, GuardSettings)

    def __init__(self) -> None:
        """Start stopped."""
        super().__init__("guard", namespace="flexarm")
        self.settings: GuardNodeSettings
        self.settings, _ = declare_configs(self)
        self._ready = ReadyFlag(self, {"guard": lambda: True})


def main() -> int:
    """Run the node."""
    return run_node(GuardNode)
