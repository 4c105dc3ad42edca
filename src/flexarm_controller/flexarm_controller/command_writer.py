"""Commands as the bytes of their messages, for a publisher: see ``flexarm_model.ros.message_writer``."""

from __future__ import annotations

from typing import Any

from flexarm_controller.command import ControlCommand
from flexarm_controller.conversions import acts_ns, command_to_msg
from flexarm_model.ros.message_writer import STAMP, MessageWriter, Serialise, stamp_values

ACTS_AT = ("acts_at.sec", "acts_at.nanosec")


class CommandWriter:
    """Writes the commands of one controller."""

    def __init__(self, serialise: Serialise) -> None:
        """Know no message yet; ``serialise`` writes any."""
        self._writer = MessageWriter((*STAMP, *ACTS_AT, "sequence", "session_token", "effort"), serialise)

    def write(
        self, command: ControlCommand, names: tuple[str, ...], sequence: int, token: int, stamp_ns: int
    ) -> Any:
        """Return the bytes, at first the message, of what ``conversions.command_to_msg`` makes of it."""
        effort, acts_at = command.tau.tolist(), stamp_values(acts_ns(command, stamp_ns))
        return self._writer.write(
            (command.model_id, names, len(effort)),
            [*stamp_values(stamp_ns), *acts_at, (sequence,), (token,), effort],
            lambda: command_to_msg(command, names, sequence, token, stamp_ns),
        )
