"""The settled filter of the estimator node.

Publishes
    ~/steady_filter (flexarm_interfaces/SteadyFilter, latched): at the first model, when noise was set, and
        when somebody asks.
Subscribes
    ~/settle (std_msgs/Empty): asks for the filter of the model in use, which may be another by now. It takes
        a while, so nobody asks while the arm is armed.
"""

from __future__ import annotations

from flexarm_interfaces.msg import SteadyFilter
from rclpy.node import Node
from std_msgs.msg import Empty

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled import settled_filter
from flexarm_model.conversions import filter_to_msg
from flexarm_model.ros.node import LATCHED_QOS, RELIABLE_QOS


class SettledFilter:
    """Tells who closes the loop what the filter comes to."""

    def __init__(self, node: Node, period: float) -> None:
        """Advertise; ``period`` is that of the control [s]."""
        self._node, self._period = node, period
        self._told: EstimatorConfig | None = None
        self._outlet = node.create_publisher(SteadyFilter, "~/steady_filter", LATCHED_QOS)
        node.create_subscription(Empty, "~/settle", self._on_settle, RELIABLE_QOS)

    def tell(self, estimator: Estimator | None) -> None:
        """Tell it if there is a new one; cheap when there is not."""
        if estimator is None or estimator.config is self._told:
            return
        self._told = estimator.config
        try:
            msg = filter_to_msg(settled_filter(estimator, self._period))
        except ValueError as error:
            msg = SteadyFilter(model_id=estimator.model.model_id, reason=str(error))
        msg.header.stamp = self._node.get_clock().now().to_msg()
        self._outlet.publish(msg)

    def _on_settle(self, msg: Empty) -> None:
        """Tell it anew with the next step."""
        self._told = None
