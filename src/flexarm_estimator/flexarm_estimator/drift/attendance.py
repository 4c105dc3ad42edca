"""Who of some sensors speaks: one is silent soon after its last word, while others speak.

Soon, because until then nothing of a period can be used. It speaks again when it has done so for a while, a
lost sample here and there aside: a loose plug is not taken in and out with every word.
"""

from __future__ import annotations

from collections.abc import Collection

STUTTER = 0.05  # s that may be missing between two words
STEADY = 1.0  # s of words until one that was silent speaks again


class Attendance:
    """Counts periods.

    Attributes:
        silent: Who is.
    """

    def __init__(self, names: Collection[str], dt: float) -> None:
        """Begin with all of them speaking.

        Args:
            names: Of the sensors.
            dt: Control period [s].
        """
        self._steady, self._stutter = round(STEADY / dt), max(1, round(STUTTER / dt))
        self._missed = dict.fromkeys(names, 0)  # periods without a word
        self._row = dict.fromkeys(names, 0)  # periods with some
        self.silent: frozenset[str] = frozenset()

    def note(self, spoken: Collection[str]) -> bool:
        """Take who spoke in a period; return whether somebody else is silent now.

        A period in which nobody spoke says nothing of one of them.
        """
        if not any(name in spoken for name in self._missed):
            return False
        silent = set(self.silent)
        for name, missed in self._missed.items():
            missed = self._missed[name] = 0 if name in spoken else missed + 1
            row = self._row[name] = self._row[name] + 1 if missed <= self._stutter else 0
            if missed > self._stutter:
                silent.add(name)
            elif row > self._steady:
                silent.discard(name)
        before, self.silent = self.silent, frozenset(silent)
        return silent != before
