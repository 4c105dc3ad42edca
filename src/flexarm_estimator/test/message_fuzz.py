"""Messages that no driver should send, drawn from a seed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from flexarm_interfaces.msg import Intervention, KnownState, StrainArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import Imu, JointState

from flexarm_model.conversions import ns_to_stamp

ODD = (0.0, -0.0, 5e-324, 1e-30, 1.0, -1.0, 1e3, 1e6, 1e154, 1e200, 1e308, -1e308, np.inf, -np.inf, np.nan)
NAMES = (
    "base.rz",
    "root_strain",
    "encoder",
    "camera",
    "strip.sensor",
    "base",
    "x",
    "",
    "Ü",
    "wheel_left_joint",
)
TOPICS = ("joint_states", "strain", "imu/tip_accelerometer", "camera/pose", "applied_effort", "scan")
TURNS = ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.1, 0.995), (0.0, 0.0, 0.0, 0.0))


class MessageFuzz:
    """Draws messages; every second one is nearly right, so that much of it gets through."""

    def __init__(self, seed: int) -> None:
        """Start the stream of chance."""
        self._rng = np.random.default_rng(seed)

    def draw(self, now_ns: int) -> tuple[str, Any]:
        """Return a topic and a message of the type that belongs there, or of another."""
        topic = TOPICS[int(self._rng.integers(len(TOPICS)))]
        kind = topic if self._rng.random() < 0.98 else "strain"
        maker = getattr(self, f"_{kind.split('/')[0]}", self._joint_states)
        msg = maker()
        msg.header.stamp = self.stamp(now_ns)
        return (topic if type(msg) is not StrainArray or topic == "strain" else "strain"), msg

    def stamp(self, now_ns: int) -> Any:
        """Return a stamp: now, a little off, or anything."""
        rng = self._rng
        choice = rng.random()
        if choice < 0.6:
            return ns_to_stamp(max(0, now_ns + int(rng.normal() * 2e6)))
        if choice < 0.8:
            return ns_to_stamp(max(0, now_ns + int(rng.normal() * 10.0 ** rng.uniform(6, 11))))
        sec = int(rng.choice([0, -1, -(2**31), 2**31 - 1, int(rng.integers(-(2**31), 2**31))]))
        return Time(sec=sec, nanosec=int(rng.choice([0, 1, 999_999_999, 2**32 - 1])))

    def intervention(self, now_ns: int) -> Any:
        """Return something a user might have done."""
        rng = self._rng
        state = KnownState(joint_names=self._names(), theta=self._numbers(), eta=self._numbers())
        state.theta_sigma, state.eta_sigma = self._numbers(), self._numbers()
        msg = Intervention(kind=int(rng.integers(0, 6)), is_on=bool(rng.random() < 0.7), state=state)
        msg.name, msg.value = str(rng.choice([*NAMES, "modal_force"])), self._numbers()
        if rng.random() < 0.3:
            msg.channels = [str(channel) for channel in rng.choice(["y", "rx", "ry", "rz", "w"], size=2)]
        msg.header.stamp = self.stamp(now_ns)
        return msg

    def steps(self, count: int, start_ns: int, period_ns: int) -> Iterator[tuple[int, list[tuple[str, Any]]]]:
        """Yield stamps to step at, some jumping, with the messages before; ``count`` messages in all."""
        now_ns, left = start_ns, count
        while left:
            size = min(left, int(self._rng.integers(1, 8)))
            left -= size
            now_ns += period_ns if self._rng.random() < 0.995 else int(self._rng.normal() * 1e11)
            yield now_ns, [self.draw(now_ns) for _ in range(size)]

    def _joint_states(self) -> Any:
        msg = JointState(name=self._names(), position=self._numbers())
        if self._rng.random() < 0.5:
            msg.name, msg.position = ["base.rz"], [float(self._rng.normal() * 0.1)]
        msg.velocity, msg.effort = self._numbers(), self._numbers()
        return msg

    _applied_effort = _joint_states

    def _strain(self) -> Any:
        msg = StrainArray(names=self._names(), strain=self._numbers(), standard_deviation=self._numbers())
        if self._rng.random() < 0.5:
            msg.names, msg.strain = ["root_strain"], [float(self._rng.normal() * 1e-5)]
        return msg

    def _imu(self) -> Any:
        msg = Imu()
        msg.header.frame_id = self._frame("strip.sensor")
        msg.linear_acceleration.x, msg.linear_acceleration.y = self._number(), self._number()
        msg.linear_acceleration_covariance = self._covariance(9)
        return msg

    def _camera(self) -> Any:
        msg = PoseWithCovarianceStamped()
        msg.header.frame_id = self._frame("base")
        position, q = msg.pose.pose.position, msg.pose.pose.orientation
        position.x, position.y, position.z = (self._number() for _ in range(3))
        q.x, q.y, q.z, q.w = TURNS[int(self._rng.integers(len(TURNS)))]
        if self._rng.random() < 0.2:
            q.x, q.w = self._number(), self._number()
        msg.pose.covariance = self._covariance(36)
        return msg

    def _frame(self, right: str) -> str:
        return right if self._rng.random() < 0.8 else str(self._rng.choice(NAMES))

    def _number(self) -> float:
        return float(self._rng.choice(ODD) if self._rng.random() < 0.3 else self._rng.normal() * 0.1)

    def _numbers(self) -> list[float]:
        return [self._number() for _ in range(int(self._rng.choice([0, 0, 1, 1, 2, 4, 300], p=_SIZES)))]

    def _names(self) -> list[str]:
        return [str(self._rng.choice(NAMES)) for _ in range(int(self._rng.choice([0, 1, 1, 2, 4])))]

    def _covariance(self, size: int) -> Any:
        rng, side = self._rng, int(np.sqrt(size))
        choice = rng.random()
        if choice < 0.3:
            return np.zeros(size)
        if choice < 0.6:
            return (np.eye(side) * 10.0 ** rng.uniform(-12, 3)).ravel()
        if choice < 0.8:
            return rng.normal(size=size)
        return np.array([self._number() for _ in range(size)])


_SIZES = (0.2, 0.1, 0.3, 0.2, 0.1, 0.09, 0.01)
