"""Commands that wait for the period they are meant for.

A law that computes for a whole period sends its command while the drives still follow the one before. The
guard lets it act when its time has come, neither sooner nor, if it can be helped, later. So the delay that
the law counts on is the one there is, however long the computation took.
"""

from __future__ import annotations

from flexarm_controller.guarding.messages import GuardCommand

FARTHEST = 11  # periods ahead of which no command is meant
SAME = 0.5  # periods between two instants that are meant to be one


class DueCommands:
    """Keeps the commands of one controller."""

    def __init__(self, period: float) -> None:
        """Keep nothing yet; ``period`` of the motors [s]."""
        self._period, self._waiting = period, list[GuardCommand]()

    def add(self, command: GuardCommand) -> None:
        """Keep a command, newer than those before."""
        self._waiting.append(command)

    def has(self, t: float) -> bool:
        """Return whether there is one that is meant for the period that begins at ``t`` [s]."""
        return any([abs(command.acts_at - t) < SAME * self._period for command in self._waiting])

    def take(self, t: float) -> GuardCommand | None:
        """Return the newest one that is meant for the period that begins at ``t`` [s], or for one before.

        It and all that were meant for no later period are forgotten, and those meant for one too far away.
        """
        if not self._waiting:
            return None
        later, farthest = t + SAME * self._period, t + FARTHEST * self._period
        due = [command for command in self._waiting if command.acts_at < later]
        self._waiting = [command for command in self._waiting if later <= command.acts_at < farthest]
        return due[-1] if due else None

    def clear(self) -> None:
        """Forget all."""
        self._waiting.clear()
