"""Sealed torques as the bytes of their messages: see ``flexarm_model.ros.message_writer``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from flexarm_controller.drives.conversions import effort_msg
from flexarm_controller.drives.seal import Mark, Seal
from flexarm_model.ros.message_writer import STAMP, MessageWriter, Serialise, stamp_values


class EffortWriter:
    """Writes the torques of one guard."""

    def __init__(self, names: Sequence[str], serialise: Serialise) -> None:
        """Know no message yet.

        Args:
            names: Actuated axes.
            serialise: Writes any message.
        """
        self._names = tuple(names)
        self._writer = MessageWriter((*STAMP, "header.frame_id", "effort"), serialise)

    def write(self, effort: Sequence[float], stamp_ns: int, seal: Seal, mark: Mark) -> Any:
        """Return torques that are to act from a stamp [ns] on, sealed: bytes, or a message."""
        text = seal.write(mark, stamp_ns, effort).encode()
        return self._writer.write(
            (len(text), len(effort)),
            [*stamp_values(stamp_ns), (text,), effort],
            lambda: effort_msg(self._names, effort, stamp_ns, seal, mark),
        )
