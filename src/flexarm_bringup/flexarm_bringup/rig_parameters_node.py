"""Named parameters of the simulated arm, which may change while it moves, and what their sensors tell.

Publishes
    parameters/<name> (sensor_msgs/FluidPressure or std_msgs/Float64): what it is, ten times a second.
Subscribes
    ~/parameters/<name> (likewise): what it is from now on; refused where its laws are not known.
"""

from __future__ import annotations

from rclpy.node import Node

from flexarm_bringup.sim.plant import Plant
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.other_parameters import ParameterRangeError
from flexarm_model.ros.node import RELIABLE_QOS
from flexarm_model.ros.parameters_node import message_types, parameter_msg, subscribe_parameters

TELL_PERIOD = 0.1  # s


class RigParameters:
    """Leads one simulated arm to other parameters, and tells them."""

    def __init__(self, node: Node, plant: Plant, config: ManipulatorConfig, period: float) -> None:
        """Begin with what is described.

        Args:
            node: The rig node.
            plant: The arm.
            config: Its description.
            period: Of the calls of ``tell`` [s].
        """
        self._node, self._plant, self._values = node, plant, dict(config.parameters)
        self._told = {
            name: (kind, node.create_publisher(kind, f"parameters/{name}", RELIABLE_QOS))
            for name, kind in message_types(config).items()
        }
        self._every, self._calls = max(round(TELL_PERIOD / period), 1), 0
        subscribe_parameters(node, config, self.on_parameter, "~/parameters")

    def on_parameter(self, name: str, value: float, variance: float) -> None:
        """Let a parameter be another from now on [SI]."""
        values = {**self._values, name: value}
        try:
            self._plant.lead(values)
        except ParameterRangeError as error:
            self._node.get_logger().error(str(error))
            return
        self._values = values

    def tell(self) -> None:
        """Publish what the parameters are, now and then; to be called once a period."""
        self._calls += 1
        if self._calls % self._every or not self._told:
            return
        stamp = self._node.get_clock().now().to_msg()
        for name, (kind, publisher) in self._told.items():
            publisher.publish(parameter_msg(kind, self._values[name], stamp))
