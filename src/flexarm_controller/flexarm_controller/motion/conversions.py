"""Goals, cancellations and progress between the core's types and ROS messages."""

from __future__ import annotations

import numpy as np
from flexarm_interfaces.msg import MotionStatus
from flexarm_interfaces.srv import CancelMotion, MoveTip
from geometry_msgs.msg import Pose
from numpy.typing import NDArray
from trajectory_msgs.msg import JointTrajectory

from flexarm_controller.conversions import reference_to_msg
from flexarm_controller.motion.motion_server import Answer
from flexarm_controller.motion.progress import Progress
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.tip_kinematics import TipGoal
from flexarm_controller.reference import Reference
from flexarm_model.conversions import NS_PER_S, ns_to_stamp
from flexarm_model.motion.conversions import LONGEST
from flexarm_model.numeric.rotation import quaternion, rotation_from_quaternion

Array = NDArray[np.float64]
OWN_FRAME = "controller"  # of references that the controller made itself; it need not take them again
TOLERANCE = 1e-4  # m, where a request says 0
UNIT = 1e-3  # by which a quaternion's length may be off 1

_STATES = {
    "accepted": MotionStatus.ACCEPTED,
    "executing": MotionStatus.EXECUTING,
    "succeeded": MotionStatus.SUCCEEDED,
    "canceled": MotionStatus.CANCELED,
    "rejected": MotionStatus.REJECTED,
    "aborted": MotionStatus.ABORTED,
}


def goal_from_request(request: MoveTip.Request) -> TipGoal:
    """Return the goal of a request.

    Raises:
        MotionError: A number is not finite, negative or too large, or the quaternion has not length 1.
    """
    for name in ("duration", "tolerance"):
        value = getattr(request, name)
        if not (np.isfinite(value) and value >= 0.0):
            raise MotionError(f"{name}: {value} must be a finite number of at least 0")
    if request.duration > LONGEST:
        raise MotionError(f"duration: {request.duration:g} s, at most {LONGEST} s are allowed")
    pose = pose_from_msg(request.target, request.with_orientation)
    return TipGoal(pose, request.with_orientation, request.duration, request.tolerance or TOLERANCE)


def pose_from_msg(msg: Pose, with_orientation: bool = True) -> Array:
    """Return the homogeneous matrix of a pose, (4, 4); without orientation that is the identity's.

    Raises:
        MotionError: A number is not finite, or the quaternion has not length 1.
    """
    pose = np.eye(4)
    pose[:3, 3] = msg.position.x, msg.position.y, msg.position.z
    if with_orientation:
        q = np.array([msg.orientation.x, msg.orientation.y, msg.orientation.z, msg.orientation.w])
        if not abs(np.linalg.norm(q) - 1.0) < UNIT:
            raise MotionError(f"target: orientation {q} has not length 1")
        pose[:3, :3] = rotation_from_quaternion(q)
    if not np.isfinite(pose).all():
        raise MotionError(f"target: position {pose[:3, 3]} is not finite")
    return pose


def pose_to_msg(pose: Array) -> Pose:
    """Return the message of a homogeneous matrix, (4, 4)."""
    msg = Pose()
    msg.position.x, msg.position.y, msg.position.z = map(float, pose[:3, 3])
    x, y, z, w = quaternion(pose[:3, :3])
    msg.orientation.x, msg.orientation.y, msg.orientation.z, msg.orientation.w = x, y, z, w
    return msg


def move_response(answer: Answer) -> MoveTip.Response:
    """Return the response to a goal."""
    response = MoveTip.Response(accepted=answer.is_accepted, reason=answer.reason, goal_id=answer.goal_id)
    response.duration = float(answer.duration)
    return response


def cancel_response(answer: Answer) -> CancelMotion.Response:
    """Return the response to a cancellation."""
    response = CancelMotion.Response(accepted=answer.is_accepted, reason=answer.reason)
    response.duration = float(answer.duration)
    return response


def progress_to_msg(progress: Progress, epoch_ns: int) -> MotionStatus:
    """Return the message of a goal's progress."""
    msg = MotionStatus(goal_id=progress.goal_id, state=_STATES[progress.stage], reason=progress.reason)
    msg.progress, msg.distance = float(progress.share), float(progress.distance)
    msg.is_settled = bool(progress.is_settled)
    msg.header.frame_id = "base"
    msg.header.stamp = ns_to_stamp(round(progress.t * NS_PER_S) + epoch_ns)
    return msg


def own_reference_msg(reference: Reference, names: tuple[str, ...], epoch_ns: int) -> JointTrajectory:
    """Return the message by which everybody learns of a reference that the controller made."""
    msg = reference_to_msg(reference, names, epoch_ns)
    msg.header.frame_id = OWN_FRAME
    return msg
