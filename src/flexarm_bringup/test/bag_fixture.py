"""A small bag to spoil: joint states and a modal state of two instants."""

from pathlib import Path
from typing import Any

import numpy as np

from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagWriter
from flexarm_bringup.topics import STREAMS

PERIOD_NS = 5_000_000
WRITTEN = tuple(stream for stream in STREAMS if stream.topic in ("joint_states", "modal_state", "model"))


def joint_state(stamp_ns: int, position: float) -> bytes:
    types = bag_types()
    message = types.types["sensor_msgs/msg/JointState"](
        header=stamped_header(stamp_ns),
        name=["base.rz"],
        position=np.array([position]),
        velocity=np.zeros(0),
        effort=np.zeros(0),
    )
    return bytes(types.serialize_cdr(message, "sensor_msgs/msg/JointState"))


def modal_state(stamp_ns: int, **changes: Any) -> bytes:
    types = bag_types()
    health = types.types["flexarm_interfaces/msg/SensorHealth"](
        "encoder", 0, "", 0.0, 3, changes.get("rejected", 0), np.array([1e-6]), 1.0
    )
    message = types.types["flexarm_interfaces/msg/ModalState"](
        header=stamped_header(stamp_ns),
        model_id="0123456789abcdef",
        joint_names=["base.rz"],
        theta=np.array([0.25]),
        theta_dot=np.zeros(1),
        disturbance=np.zeros(1),
        names=["mode_1", "mode_2"],
        eta=np.asarray(changes.get("eta", [1e-3, 2e-3])),
        eta_dot=np.zeros(2),
        sag=np.zeros(0),
        stiffness=np.zeros(0),
        bias_names=[],
        bias=np.zeros(0),
        covariance=np.eye(7).ravel(),
        status=0,
        reason=changes.get("reason", ""),
        age=0.5,
        sensors=[health],
    )
    return bytes(types.serialize_cdr(message, "flexarm_interfaces/msg/ModalState"))


def write_bag(path: Path, ticks: int = 2, **changes: Any) -> Path:
    """Write a bag of ``ticks`` instants; ``changes`` apply to the modal state of the last."""
    with BagWriter(path, WRITTEN, {"git": "0" * 40}) as writer:
        for k in range(ticks):
            stamp_ns = k * PERIOD_NS
            writer.write("/flexarm/joint_states", stamp_ns, joint_state(stamp_ns, 0.1 * k))
            last = changes if k == ticks - 1 else {}
            writer.write("/flexarm/modal_state", stamp_ns, modal_state(stamp_ns, **last))
    return path


def stamped_header(stamp_ns: int) -> Any:
    """Return a header with a stamp."""
    types = bag_types().types
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    return types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](sec, nanosec), "base")
