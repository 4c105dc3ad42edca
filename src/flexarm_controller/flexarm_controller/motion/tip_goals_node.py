"""Goals of the tip as services and topics of the controller node.

Publishes
    motion_status (flexarm_interfaces/MotionStatus): 20 Hz while a goal is pursued, and what becomes of it;
        the last of them also for who comes late, if they ask for them.
    reference (trajectory_msgs/JointTrajectory): the motion to a goal, or to rest, when it is taken.
Subscribes
    model/models (std_msgs/String, latched): what the model node says of references; not in lockstep.
    parameters/<name> (see ``flexarm_model.ros.parameters_node``): how the arm sags at the goals to come.
Services
    ~/move_tip (flexarm_interfaces/MoveTip): move the tip to a pose.
    ~/cancel (flexarm_interfaces/CancelMotion): bring whatever moves to rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flexarm_interfaces.msg import MotionStatus
from flexarm_interfaces.srv import CancelMotion, MoveTip
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

from flexarm_controller.answer import Outgoing
from flexarm_controller.motion.conversions import OWN_FRAME
from flexarm_controller.motion.motion_exchange import MotionExchange
from flexarm_controller.motion.refusals import MotionError
from flexarm_model.process.beside import Beside
from flexarm_model.ros.node import GOALS_QOS, TOLD_QOS
from flexarm_model.ros.parameters_node import subscribe_parameters
from flexarm_model.ros.patient_answers_node import LateAnswer

MODELS_SAID = "model/models"  # on which the model node says what there is for a reference
LOOK_PERIOD, FIRST_AHEAD = 0.005, 0.1  # s, for goals that are planned; that the first is given
DEPTH = 100  # of references


class TipGoals:
    """Connects a ``MotionExchange`` to a node.

    Attributes:
        outlets: Publishers by relative topic.
    """

    def __init__(
        self,
        node: Node,
        exchange: MotionExchange,
        publish: Callable[[Sequence[Outgoing]], None],
        beside: Beside | None,
    ) -> None:
        """Offer the services.

        Args:
            node: Gets services and publishers.
            exchange: Answers.
            publish: Sends what it says, on ``outlets`` and on the node's own topics.
            beside: Plans; None in lockstep, where nothing may depend on when a message comes.
        """
        self._node, self._exchange, self._publish = node, exchange, publish
        self.outlets = {
            "motion_status": node.create_publisher(MotionStatus, "motion_status", GOALS_QOS),
            "reference": node.create_publisher(JointTrajectory, "reference", QoSProfile(depth=DEPTH)),
        }
        self._beside = beside
        self._looking = node.create_timer(
            LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._looking.cancel()
        said = node.resolve_topic_name(MODELS_SAID)
        if beside is not None:
            exchange.ahead = FIRST_AHEAD
            exchange.has_models = lambda: node.count_publishers(said) > 0
            node.create_subscription(String, MODELS_SAID, self.on_models, TOLD_QOS)
            subscribe_parameters(node, exchange.arm, exchange.on_parameter)
        node.create_service(MoveTip, "~/move_tip", self.on_move_tip)
        node.create_service(CancelMotion, "~/cancel", self.on_cancel)

    def on_move_tip(self, request: MoveTip.Request, _: MoveTip.Response) -> MoveTip.Response | LateAnswer:
        """Begin to move, or say why not; by the clock another process plans."""
        if self._beside is None:
            return self._answer(self._exchange.on_move_tip(request))
        if not self._exchange.has_models():
            why = f"nobody says on {MODELS_SAID} that there are models for it: is the model node active?"
            return MoveTip.Response(accepted=False, reason=why)
        late = LateAnswer()
        self._beside.begin(self._exchange.moving_tip(request), lambda found: late.give(self._answer(found)))
        if self._beside.is_busy:
            self._looking.reset()
        return late

    def on_cancel(self, request: CancelMotion.Request, _: CancelMotion.Response) -> CancelMotion.Response:
        """Bring the arm to rest, or say why not."""
        dropped = 0 if request.goal_id else self._drop("canceled while it was planned")
        response, outgoing = self._exchange.on_cancel(request)
        if dropped and not response.accepted:  # for nothing moves yet
            response = CancelMotion.Response(accepted=True)
        self._node.get_logger().info(f"cancel: {response.reason or 'stopping'}")
        self._publish(outgoing)
        return response

    def take(self, msg: JointTrajectory) -> str:
        """Follow a reference of others, or not; returns the verdict."""
        outgoing = self._exchange.on_reference(msg)
        self._publish(outgoing)
        return str(outgoing[0].msg.reason)

    def on_models(self, msg: String) -> None:
        """Bring the arm to rest if there are no models for what it follows."""
        if outgoing := self._exchange.on_models(msg.data):
            self._node.get_logger().error(outgoing[0].msg.reason)
        self._publish(outgoing)

    def update(self) -> None:
        """Tell how far the goal has got; to be called after each state."""
        self._publish(self._exchange.update())

    def end(self, why: str) -> None:
        """Say the last word on what is pursued, or planned; to be called before the topics go."""
        self._drop(why)
        self._publish(self._exchange.end(why))
        if self._beside is not None:
            self._beside.end()

    def _look(self) -> None:
        """Go on with goals that were planned by now."""
        if self._beside is not None:
            self._beside.look()
        if self._beside is None or not self._beside.is_busy:
            self._looking.cancel()

    def _drop(self, why: str) -> int:
        """Refuse the goals that are being planned; returns how many."""
        return 0 if self._beside is None else self._beside.drop(MotionError(why))

    def _answer(self, found: tuple[MoveTip.Response, list[Outgoing]]) -> MoveTip.Response:
        response, outgoing = found
        words = f"goal {response.goal_id}, {response.duration:.3f} s" if response.accepted else "refused"
        self._node.get_logger().info("; ".join(filter(None, [f"move_tip: {words}", response.reason])))
        self._publish(outgoing)
        return response

    @staticmethod
    def is_own(msg: JointTrajectory) -> bool:
        """Tell whether a reference is one that was made here and is followed already."""
        return bool(msg.header.frame_id == OWN_FRAME)
