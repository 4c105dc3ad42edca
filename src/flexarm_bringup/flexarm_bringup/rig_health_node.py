"""Faults of the simulated sensors and of their clock on request, and what the rig says of itself.

Publishes
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz: does it keep time, and which faults were asked for.
Subscribes
    ~/faults (std_msgs/String): faults from now on, as the parameter ``faults`` has them, times counted from
        now ("camera: off 0 2; root_strain: stuck"); empty ends all. What is not understood changes nothing.
    ~/clock_jump (std_msgs/Float64): all stamps are so many seconds later from the next period on.
    See ``rig_parameters_node``, not in lockstep.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.node import Node
from std_msgs.msg import Float64, String

from flexarm_bringup.rig_parameters_node import RigParameters
from flexarm_bringup.sim.drives import Drives
from flexarm_bringup.sim.sensor_fault_text import faults_text, parse_faults
from flexarm_model.conversions import NS_PER_S
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.ros.diagnostics_node import Diagnostics
from flexarm_model.ros.loop_health import LoopHealth
from flexarm_model.ros.node import RELIABLE_QOS
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Level, Verdict
from flexarm_model.settings.strict_yaml import ConfigError

LONGEST_JUMP = 1e6  # s


class RigHealth:
    """Watches one rig."""

    def __init__(
        self,
        node: Node,
        drives: Drives,
        config: ManipulatorConfig,
        period: float | None,
        told: DiagnosticsConfig,
        jump: Callable[[int], None],
    ) -> None:
        """Watch.

        Args:
            node: The rig node.
            drives: Rig whose sensors can be given faults.
            config: The manipulator.
            period: Of its timer [s]; None in lockstep.
            told: Thresholds.
            jump: Lets all stamps be later from the next period on [ns].
        """
        self._node, self._drives, self._config, self._jump = node, drives, config, jump
        self._loop = LoopHealth("rig: loop", period, told)
        self._skipped = 0
        plant = drives.rig.plant
        self._parameters = None if period is None else RigParameters(node, plant, config, period)
        node.create_subscription(String, "~/faults", self.on_faults, RELIABLE_QOS)
        node.create_subscription(Float64, "~/clock_jump", self.on_clock_jump, RELIABLE_QOS)
        self._diagnostics = Diagnostics(node, self.verdicts)

    def beat(self, behind: int) -> None:
        """Note that the timer fired ``behind`` periods after the last advance; 1 is on time."""
        self._loop.beat(time.perf_counter())
        self._skipped += max(behind - 1, 0)
        self._loop.count("periods late", self._skipped)
        if self._parameters is not None:
            self._parameters.tell()

    def on_faults(self, msg: String) -> None:
        """Give the sensors other faults from now on."""
        try:
            faults = parse_faults(msg.data, self._config.sensors)
        except ConfigError as error:
            self._node.get_logger().error(str(error))
            return
        self._drives.set_faults(faults)
        self._node.get_logger().info(f"faults: {msg.data or 'none'}")

    def on_clock_jump(self, msg: Float64) -> None:
        """Let the clock of all stamps jump, as it does when somebody sets it."""
        if not abs(msg.data) <= LONGEST_JUMP:
            self._node.get_logger().error(f"clock_jump: {msg.data:g} s is not within {LONGEST_JUMP:g} s")
            return
        self._jump(round(msg.data * NS_PER_S))
        self._node.get_logger().warning(f"the clock jumps by {msg.data:g} s")

    def verdicts(self) -> list[Verdict]:
        """Judge the last second."""
        text = faults_text(self._drives.rig.faults, self._config.sensors)
        faults = Verdict("rig: faults", Level.WARN if text else Level.OK, text or "none")
        return [faults, self._loop.verdict()]
