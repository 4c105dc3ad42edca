"""The one table of all streams: who says what, how often and how reliably.

Recorder, replay, bag checks and the documentation read it; within an instant messages are logged
in its order, which is the order of cause and effect. Topics are relative to the namespace
``/flexarm`` unless they start with a slash. ``imu/*`` stands for one topic per IMU, ``camera/*`` per camera.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

from flexarm_model.manipulator.cameras import USUAL

NAMESPACE = "/flexarm"
NAMELESS = "_NODE_NAME_UNKNOWN_"  # rmw: a publisher whose node has not been heard of
_KEPT = 256  # names that have been looked up


@dataclass(frozen=True)
class Stream:
    """One topic.

    Attributes:
        topic: Relative name; ``imu/*`` and ``camera/*`` are families.
        type: Message type, "package/msg/Name".
        publisher: Node that publishes it; "user" for what comes from outside.
        rate: When it is sent, for the reader.
        text: What it carries, for the reader.
        depth: Depth of the publisher's history [1].
        is_latched: Late subscribers get the last message (transient local).
        is_stamped: The message starts with a std_msgs/Header.
        is_sensor: The estimator reads it as a measurement.
        is_optional: A run may do without it.
    """

    topic: str
    type: str
    publisher: str
    rate: str
    text: str
    depth: int = 1
    is_latched: bool = False
    is_stamped: bool = True
    is_sensor: bool = False
    is_optional: bool = False

    @property
    def name(self) -> str:
        """Absolute topic."""
        return self.topic if self.topic.startswith("/") else f"{NAMESPACE}/{self.topic}"


STREAMS = (
    Stream("model", "flexarm_interfaces/msg/ReducedModel", "model", "ahead of motions",
           "reduced models, each in use from its stamp on", depth=500, is_latched=True),
    Stream("robot_description", "std_msgs/msg/String", "markers", "once",
           "URDF with the modes as segment joints", is_latched=True, is_stamped=False, is_optional=True),
    Stream("reference", "trajectory_msgs/msg/JointTrajectory", "user", "event",
           "motion asked for", is_optional=True),
    Stream("joint_states", "sensor_msgs/msg/JointState", "rig", "motor period",
           "motor side position, velocity and measured torque", depth=10, is_sensor=True),
    Stream("drive_states", "sensor_msgs/msg/JointState", "rig", "motor period",
           "position and velocity as the drives measure them for themselves; the guard's", is_optional=True),
    Stream("strain", "flexarm_interfaces/msg/StrainArray", "rig", "gauge rate",
           "surface strain with its standard deviation", depth=10, is_sensor=True),
    Stream("imu/*", "sensor_msgs/msg/Imu", "rig", "rate of its sensors",
           "what accelerometer (+g at rest) or gyroscope of one unit feels", depth=10, is_sensor=True),
    Stream("camera/*", "geometry_msgs/msg/PoseWithCovarianceStamped", "rig", "rate of the camera",
           "pose of the tip, stamped at exposure", depth=10, is_sensor=True),
    Stream("applied_effort", "sensor_msgs/msg/JointState", "guard", "motor period",
           "torque that the guard lets through, sealed; what a rig driver subscribes to", is_sensor=True),
    Stream("truth", "flexarm_interfaces/msg/Truth", "rig", "motor period",
           "what really happens in the simulation; for reports only", depth=10, is_optional=True),
    Stream("guard_status", "flexarm_interfaces/msg/GuardStatus", "guard", "10 Hz and on change",
           "what the guard lets through, and why"),
    Stream("tick", "flexarm_interfaces/msg/Tick", "rig", "lockstep only",
           "what was sent at this instant", depth=10, is_optional=True),
    Stream("modal_state", "flexarm_interfaces/msg/ModalState", "estimator", "control rate",
           "joints, modes and disturbance with covariance and health", depth=10),
    Stream("end_effector", "nav_msgs/msg/Odometry", "estimator", "control rate",
           "pose and velocity of the tip with covariance", depth=10),
    Stream("estimator/interventions", "flexarm_interfaces/msg/Intervention", "estimator", "event",
           "what a user did to the estimator; a replay does it again", depth=10, is_optional=True),
    Stream("joint_commands", "flexarm_interfaces/msg/JointCommand", "controller", "control rate",
           "torque asked for"),
    Stream("excitation", "sensor_msgs/msg/JointState", "excite", "control rate during modal tests",
           "part of the torque asked for that excites; what holds the arm is left out", is_optional=True),
    Stream("excite/test", "std_msgs/msg/String", "excite", "once, at the end of a modal test",
           "plan, sensor check and starts of the runs, as JSON", is_latched=True, is_stamped=False,
           is_optional=True),
    Stream("controller_status", "flexarm_interfaces/msg/ControllerStatus", "controller",
           "control rate up to 200 Hz, and on change", "mode, solver, limits that bind, reason"),
    Stream("motion_status", "flexarm_interfaces/msg/MotionStatus", "controller", "20 Hz during goals",
           "how far a goal of the tip has got, and what became of it", depth=100, is_optional=True),
    Stream("controller_debug", "flexarm_interfaces/msg/ControllerDebug", "controller", "control rate",
           "tip and vibration that the plan leads to, where the time went; while somebody listens",
           depth=10, is_optional=True),
    Stream("feedback_gains", "flexarm_interfaces/msg/FeedbackGains", "controller", "control rate",
           "law about the state in which a command begins to act; while somebody listens", is_optional=True),
    Stream("predicted", "trajectory_msgs/msg/JointTrajectory", "controller", "20 Hz",
           "motion of the axes that the plan leads to; while somebody listens", depth=10, is_optional=True),
    Stream("markers", "visualization_msgs/msg/MarkerArray", "markers", "10-20 Hz",
           "shape of the arm for a viewer", depth=10, is_stamped=False, is_optional=True),
    Stream("segment_states", "sensor_msgs/msg/JointState", "markers", "10-20 Hz",
           "joints of robot_description, those of the modes too", depth=10, is_optional=True),
    Stream("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "all", "1 Hz",
           "health of every node", depth=10, is_optional=True),
)  # fmt: skip


def streams(imus: Iterable[str], cameras: Iterable[str] = (USUAL,)) -> tuple[Stream, ...]:
    """Return the table with its families written out, one topic per IMU and per camera."""
    written: list[Stream] = []
    families = {"imu/*": tuple(imus), "camera/*": tuple(cameras)}
    for stream in STREAMS:
        if stream.topic in families:
            written += [replace(stream, topic=stream.topic[:-1] + name) for name in families[stream.topic]]
        else:
            written.append(stream)
    return tuple(written)


@lru_cache(maxsize=_KEPT)
def find_stream(name: str) -> Stream | None:
    """Return the row that an absolute topic belongs to, its family written out; None if there is none."""
    for stream in STREAMS:
        if stream.name == name:
            return stream
        prefix = stream.name[:-1]
        if stream.topic.endswith("/*") and name.startswith(prefix) and len(name) > len(prefix):
            return replace(stream, topic=stream.topic[:-1] + name[len(prefix) :])
    return None
