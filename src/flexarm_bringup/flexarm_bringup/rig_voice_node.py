"""What the rig node says of a tick.

Publishes
    drive_states, joint_states, strain, imu/<name>, camera/pose, truth, tick: see ``rig_node``.

In real time the messages of a tick are made ahead, most of them down to their bytes: when its time has come
they are only sent, and everybody who waits for them has the period for himself. The estimator's come first:
the drives' state wakes the guard, which has more priority than the rig, and waits for the command anyway.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flexarm_interfaces.msg import Tick
from rclpy.node import Node
from rclpy.serialization import serialize_message

from flexarm_bringup.message_class import message_class
from flexarm_bringup.sim.conversions import Outgoing, truth_msg
from flexarm_bringup.sim.drives import Drives
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.tick_writer import TickWriter
from flexarm_bringup.topics import streams
from flexarm_model.conversions import ns_to_stamp
from flexarm_model.manipulator.cameras import cameras
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imu import imus
from flexarm_model.ros.node import LOCKSTEP_QOS, PERIODIC_QOS


class RigVoice:
    """Publishes what drives and sensors deliver."""

    def __init__(self, node: Node, drives: Drives, config: ManipulatorConfig, is_lockstep: bool) -> None:
        """Make the publishers.

        Args:
            node: The rig node.
            drives: Rig with its drives.
            config: The manipulator.
            is_lockstep: Every tick says what was sent.
        """
        self._drives, self._config, self._is_lockstep = drives, config, is_lockstep
        quality = LOCKSTEP_QOS if is_lockstep else PERIODIC_QOS
        self._outlets = {
            stream.topic: node.create_publisher(message_class(stream.type), stream.topic, quality)
            for stream in streams(imus(config.sensors), cameras(config.sensors))
            if stream.publisher == "rig" and (is_lockstep or stream.topic != "tick")
        }
        self._writer = TickWriter(config, drives, serialize_message)
        self._made: tuple[int, list[Outgoing]] = (-1, [])  # stamp of a tick [ns] and its messages
        self._sent: dict[str, int] = {}
        self._gaps = 0  # in the numbers of ticks

    def make(self, samples: Sequence[Sample], stamp_of: Callable[[int], int]) -> None:
        """Make the messages of the tick at which the rig is now, to be sent later.

        Args:
            samples: What the sensors deliver at it.
            stamp_of: Stamp [ns] of a tick.
        """
        now_ns = stamp_of(self._drives.rig.tick)
        self._made = now_ns, self._messages(samples, now_ns, stamp_of)

    def say(self, samples: Sequence[Sample], stamp_of: Callable[[int], int]) -> None:
        """Send the messages of the tick at which the rig is now; see ``make``."""
        now_ns = stamp_of(self._drives.rig.tick)
        (made_ns, messages), self._made = self._made, (-1, [])
        if made_ns != now_ns:  # not made, or of a time that was skipped
            messages = self._messages(samples, now_ns, stamp_of)
        for out in messages:
            self._outlets[out.topic].publish(out.msg)
            self.note_sent(out.topic)
        if self._is_lockstep:
            number = self._drives.rig.tick + self._gaps
            msg = Tick(sequence=number, topics=list(self._sent), counts=[*self._sent.values()])
            msg.header.stamp = ns_to_stamp(now_ns)
            self._outlets["tick"].publish(msg)
        self._sent.clear()

    def skip(self) -> None:
        """Leave a gap before the next tick: all forget what came before it that no tick announced."""
        self._gaps += 1

    def note_sent(self, topic: str, count: int = 1) -> None:
        """Note what the next tick announces."""
        if count:
            self._sent[topic] = self._sent.get(topic, 0) + count

    def _messages(
        self, samples: Sequence[Sample], now_ns: int, stamp_of: Callable[[int], int]
    ) -> list[Outgoing]:
        """Return what is said, in the order in which it is sent."""
        write = self._writer
        messages = [
            *write.sensors(samples, stamp_of),
            Outgoing("joint_states", write.joint_states(now_ns)),
            Outgoing("drive_states", write.drive_states(now_ns)),
        ]
        if self._is_lockstep or self._outlets["truth"].get_subscription_count():
            messages.append(Outgoing("truth", truth_msg(self._config, self._drives.rig.truth(), now_ns)))
        return messages
