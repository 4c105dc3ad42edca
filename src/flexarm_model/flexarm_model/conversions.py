"""Stamps, reduced models, settled filters and verdicts, between the core's types and messages.

Matrices travel row major, frequencies in Hz for the reader. ``omega`` is read back from the modal
stiffness ``omega^2``, because a square root undoes a square bit for bit and a factor 2 pi does
not. ``model_from_msg`` does not trust what it reads: lengths, finiteness and the content hash are
checked, so a model that passes is the model that was sent.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from flexarm_interfaces.msg import ReducedModel as ReducedModelMsg
from flexarm_interfaces.msg import SteadyFilter as SteadyFilterMsg
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.served.steady_filter import SteadyFilter
from flexarm_model.settings.diagnosis import Level, Verdict

Array = NDArray[np.float64]
NS_PER_S = 1_000_000_000
LAST_STAMP_NS = (2**31 - 3600) * NS_PER_S  # what answers a later one could not be written


class ModelMessageError(ValueError):
    """A reduced model or settled filter message cannot be used; the text says which field and why."""


def stamp_to_ns(stamp: Time | Duration) -> int:
    """Return a ROS stamp or duration as integer nanoseconds."""
    return int(stamp.sec) * NS_PER_S + int(stamp.nanosec)


def ns_to_stamp(stamp_ns: int) -> Time:
    """Return integer nanoseconds as a ROS stamp."""
    sec, nanosec = divmod(stamp_ns, NS_PER_S)
    return Time(sec=sec, nanosec=nanosec)


def floats(values: Array | Sequence[float]) -> array[float]:
    """Return numbers of any shape, row major, as the sequence that messages take fastest."""
    return array("d", np.ascontiguousarray(values, dtype=np.float64).tobytes())


def model_to_msg(model: ReducedModel, stamp_ns: int = 0, frame_id: str = "base") -> ReducedModelMsg:
    """Return the message of a model, computed at ``stamp_ns``, poses in ``frame_id``.

    Raises:
        ValueError: The modal stiffness is not ``omega^2``; the receiver could not restore it.
    """
    if not np.array_equal(_omega(model.K, model.n_theta), model.omega):
        raise ValueError(f"{model.manipulator}: K of the modes is not omega^2, so the model cannot be sent")
    msg = ReducedModelMsg()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = frame_id
    msg.model_id, msg.config_id, msg.manipulator = model.model_id, model.config_id, model.manipulator
    msg.theta_names, msg.eta_names = list(model.theta_names), list(model.eta_names)
    msg.pose, msg.bias, msg.q0, msg.phi = map(floats, (model.pose, model.f0, model.q0, model.Phi))
    msg.mass, msg.damping, msg.stiffness, msg.input = map(floats, (model.M, model.D, model.K, model.B))
    msg.f_hz, msg.zeta = floats(model.omega / (2 * np.pi)), floats(model.zeta)
    out = model.outputs
    msg.output_names, msg.output_units, msg.y0 = list(out.names), list(out.units), floats(out.y0)
    msg.c_pos, msg.c_vel, msg.c_acc = map(floats, (out.C_pos, out.C_vel, out.C_acc))
    return msg


def model_from_msg(msg: ReducedModelMsg) -> ReducedModel:
    """Return the model of a message, bit for bit.

    Raises:
        ModelMessageError: A length is wrong, a number is not finite, the mass is not positive, or the
            content does not have the hash that ``model_id`` says.
    """
    n_theta, n_eta, n_y, n_q = len(msg.theta_names), len(msg.eta_names), len(msg.output_names), len(msg.q0)
    n = n_theta + n_eta
    if len(msg.output_units) != n_y:
        raise ModelMessageError(f"output_units: {len(msg.output_units)} entries, {n_y} expected")
    K = _array(msg, "stiffness", n, n)
    outputs = Outputs(
        tuple(msg.output_names), tuple(msg.output_units), _array(msg, "y0", n_y),
        _array(msg, "c_pos", n_y, n), _array(msg, "c_vel", n_y, n), _array(msg, "c_acc", n_y, n),
    )  # fmt: skip
    model = ReducedModel(
        msg.manipulator, msg.config_id, tuple(msg.theta_names), _array(msg, "pose", n_theta),
        _array(msg, "mass", n, n), _array(msg, "damping", n, n), K,
        _array(msg, "input", n, n_theta), _array(msg, "bias", n),
        _omega(K, n_theta), _array(msg, "zeta", n_eta), outputs,
        _array(msg, "q0", n_q), _array(msg, "phi", n_q, n),
    )  # fmt: skip
    _array(msg, "f_hz", n_eta)
    if n and not np.linalg.eigvalsh(model.M).min() > 0.0:  # of its lower half; also NaN
        raise ModelMessageError("mass: is not positive definite, no arm moves like that")
    if model.model_id != msg.model_id:
        raise ModelMessageError(
            f"model_id: message says '{msg.model_id}', its content is '{model.model_id}': "
            "it was changed on the way, or its sender is of another version of flexarm"
        )
    return model


def filter_to_msg(filter_: SteadyFilter, stamp_ns: int = 0) -> SteadyFilterMsg:
    """Return the message of a settled filter, worked out at ``stamp_ns``."""
    msg = SteadyFilterMsg(model_id=filter_.model_id, period=filter_.dt, states=len(filter_.F))
    msg.rows, msg.left_out = list(filter_.rows), list(filter_.left_out)
    msg.f, msg.g, msg.l = map(floats, (filter_.F, filter_.G, filter_.L))
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg


def filter_from_msg(msg: SteadyFilterMsg, n_u: int) -> SteadyFilter:
    """Return the settled filter of a message, for ``n_u`` torques.

    Raises:
        ModelMessageError: There is none, a length is wrong, or a number is not finite.
    """
    if msg.reason:
        raise ModelMessageError(f"the estimator has no settled filter: {msg.reason}")
    n_x, n_y = int(msg.states), len(msg.rows)
    F, G, L = (_array(msg, *shape) for shape in (("f", n_x, n_x), ("g", n_x, n_u), ("l", n_x, n_y)))
    return SteadyFilter(msg.model_id, msg.period, tuple(msg.rows), tuple(msg.left_out), F, G, L)


def verdict_to_msg(verdict: Verdict, node: str) -> DiagnosticStatus:
    """Return a verdict of a node as a status of /diagnostics."""
    pairs = [KeyValue(key=key, value=value) for key, value in verdict.values.items()]
    return DiagnosticStatus(
        name=verdict.subject,
        hardware_id=node,
        level=bytes([verdict.level]),
        message=verdict.text,
        values=pairs,
    )


def verdict_from_msg(msg: DiagnosticStatus) -> Verdict:
    """Return the verdict of a status of /diagnostics, also of nodes that are not ours."""
    values = {pair.key: pair.value for pair in msg.values}
    return Verdict(msg.name, Level(min(msg.level[0], Level.STALE)), msg.message, values)


def _array(msg: ReducedModelMsg | SteadyFilterMsg, name: str, *shape: int) -> Array:
    values = np.array(getattr(msg, name), dtype=np.float64)
    expected = int(np.prod(shape))
    if values.size != expected:
        raise ModelMessageError(f"{name}: {values.size} numbers, {expected} expected")
    if not np.isfinite(values).all():
        raise ModelMessageError(f"{name}: a number is not finite")
    return values.reshape(shape)


def _omega(K: Array, n_theta: int) -> Array:
    """Frequencies of the modes [rad/s] from their stiffness, (n_eta,); NaN where it is negative."""
    modal = np.diag(K)[n_theta:]
    return np.sqrt(np.where(modal < 0.0, np.nan, modal))
