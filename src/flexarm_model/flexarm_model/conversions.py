"""Stamps and the reduced model, between the core's types and ROS messages.

Matrices travel row major. ``model_from_msg`` does not trust what it reads: lengths, finiteness
and the content hash are checked, so a model that passes is the model that was sent.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from flexarm_interfaces.msg import ReducedModel as ReducedModelMsg
from numpy.typing import NDArray

from flexarm_model.reduced_model import Outputs, ReducedModel

Array = NDArray[np.float64]
NS_PER_S = 1_000_000_000


class ModelMessageError(ValueError):
    """A reduced model message cannot be used; the text says which field and why."""


def stamp_to_ns(stamp: Time) -> int:
    """Return a ROS stamp as integer nanoseconds."""
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


def ns_to_stamp(stamp_ns: int) -> Time:
    """Return integer nanoseconds as a ROS stamp."""
    sec, nanosec = divmod(stamp_ns, NS_PER_S)
    return Time(sec=sec, nanosec=nanosec)


def floats(values: Array | Sequence[float]) -> array[float]:
    """Return numbers of any shape, row major, as the sequence that messages take fastest."""
    return array("d", np.ascontiguousarray(values, dtype=np.float64).tobytes())


def model_to_msg(model: ReducedModel, stamp_ns: int = 0, frame_id: str = "base") -> ReducedModelMsg:
    """Return the message of a model, computed at ``stamp_ns``, poses in ``frame_id``."""
    msg = ReducedModelMsg()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = frame_id
    msg.model_id, msg.config_id, msg.manipulator = model.model_id, model.config_id, model.manipulator
    msg.theta_names, msg.eta_names = list(model.theta_names), list(model.eta_names)
    msg.pose, msg.bias, msg.q0, msg.phi = map(floats, (model.pose, model.f0, model.q0, model.Phi))
    msg.mass, msg.damping, msg.stiffness, msg.input = map(floats, (model.M, model.D, model.K, model.B))
    msg.omega, msg.zeta = floats(model.omega), floats(model.zeta)
    out = model.outputs
    msg.output_names, msg.output_units, msg.y0 = list(out.names), list(out.units), floats(out.y0)
    msg.c_pos, msg.c_vel, msg.c_acc = map(floats, (out.C_pos, out.C_vel, out.C_acc))
    return msg
