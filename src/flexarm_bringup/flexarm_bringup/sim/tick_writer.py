"""What the simulated hardware says in every period, as the bytes of its messages.

The same as ``conversions`` makes of it, in a fraction of the time: see ``flexarm_model.ros.message_writer``.
What comes seldom, a frame of the camera, goes as a message.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from flexarm_bringup.sim.conversions import (
    Outgoing,
    gauges,
    joint_state_msg,
    sample_msg,
    strain_msg,
    told_axes,
    told_strains,
)
from flexarm_bringup.sim.drives import Drives
from flexarm_bringup.sim.sample import Sample
from flexarm_controller.drives.conversions import drive_state_msg
from flexarm_estimator.messages.sensor_messages import INERTIAL_FIELDS
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imu import unit_of
from flexarm_model.ros.message_writer import STAMP, MessageWriter, Serialise, stamp_values

_JOINTS = (*STAMP, "position", "velocity", "effort")
_CHANNELS = "xyz"


class TickWriter:
    """Writes the messages of one rig."""

    def __init__(self, config: ManipulatorConfig, drives: Drives, serialise: Serialise) -> None:
        """Know no message yet.

        Args:
            config: The manipulator.
            drives: Rig with its drives.
            serialise: Writes any message.
        """
        self._drives = drives
        self._specs = {spec.name: spec for spec in config.sensors}
        self._joint_states, self._drive_states = (MessageWriter(_JOINTS, serialise) for _ in range(2))
        self._strain = MessageWriter((*STAMP, "strain"), serialise)
        self._imu = {
            kind: MessageWriter((*STAMP, *(f"{field}.{channel}" for channel in _CHANNELS)), serialise)
            for kind, field in INERTIAL_FIELDS.items()
        }

    def drive_states(self, stamp_ns: int) -> Any:
        """Return what the drives measure for themselves, and the torque that acted until the stamp [ns]."""
        drives, state = self._drives, self._drives.state()
        values = [*stamp_values(stamp_ns), state.position, state.velocity, drives.acted]
        return self._drive_states.write(
            drives.names, values, lambda: drive_state_msg(drives.names, state, drives.acted, stamp_ns)
        )

    def joint_states(self, stamp_ns: int) -> Any:
        """Return what the encoders tell at a stamp [ns]."""
        names, *numbers = told_axes(self._drives)
        return self._joint_states.write(
            names, [*stamp_values(stamp_ns), *numbers], lambda: joint_state_msg(self._drives, stamp_ns)
        )

    def sensors(self, samples: Sequence[Sample], stamp_of: Callable[[int], int]) -> list[Outgoing]:
        """Return what all sensors but the encoders tell.

        Args:
            samples: What arrived at this tick.
            stamp_of: Stamp [ns] of a tick.
        """
        written = [
            self._gauges(together, stamp_of(tick) + late_ns)
            for (tick, late_ns), together in gauges(samples).items()
        ]
        for sample in samples:
            stamp_ns = stamp_of(sample.tick) + sample.late_ns
            if sample.kind in self._imu:
                written.append(self._inertial(sample, stamp_ns))
            elif sample.kind == "camera":
                written.append(sample_msg(self._specs[sample.sensor], sample, stamp_ns))
        return written

    def _gauges(self, samples: Sequence[Sample], stamp_ns: int) -> Outgoing:
        names = tuple(sample.sensor for sample in samples)
        values = [*stamp_values(stamp_ns), told_strains(self._specs, samples)]
        raw = self._strain.write(names, values, lambda: strain_msg(self._specs, samples, stamp_ns).msg)
        return Outgoing("strain", raw)

    def _inertial(self, sample: Sample, stamp_ns: int) -> Outgoing:
        spec = self._specs[sample.sensor]
        told = dict(zip(spec.channels, sample.y.tolist(), strict=True))
        values = [*stamp_values(stamp_ns), *((told.get(channel, 0.0),) for channel in _CHANNELS)]
        write = self._imu[sample.kind].write
        raw = write(sample.sensor, values, lambda: sample_msg(spec, sample, stamp_ns).msg)
        return Outgoing(f"imu/{unit_of(spec)}", raw)
