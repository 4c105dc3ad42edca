"""Statuses as the bytes of their messages: see ``flexarm_model.ros.message_writer``."""

from __future__ import annotations

from functools import partial
from typing import Any

from flexarm_controller.command import ControlCommand
from flexarm_controller.conversions import status_to_msg
from flexarm_model.ros.message_writer import STAMP, MessageWriter, Serialise, stamp_values

_NUMBERS = ("iterations", "residual", "solve_time", "missed_cycles", "overruns", "tracking_error")


class StatusWriter:
    """Writes the statuses of one controller."""

    def __init__(self, serialise: Serialise) -> None:
        """Know no message yet; ``serialise`` writes any."""
        self._writer = MessageWriter((*STAMP, *_NUMBERS), serialise)

    def write(self, command: ControlCommand, missed: int, overruns: int, stamp_ns: int) -> Any:
        """Return the bytes, at first the message, of what ``conversions.status_to_msg`` makes of it."""
        off = command.tracking_error.tolist()
        limits = tuple(command.limits_active)
        key = command.mode, command.reason, command.model_id, command.solver_status, limits, len(off)
        numbers = command.iterations, command.residual, command.solve_time, missed, overruns
        return self._writer.write(
            key,
            [*stamp_values(stamp_ns), *((number,) for number in numbers), off],
            partial(status_to_msg, command, missed, overruns, stamp_ns),
        )
