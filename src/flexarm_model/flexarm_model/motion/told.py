"""What nodes tell each other of a reference, "stamp: words", read from a topic on which anybody may speak."""

from __future__ import annotations

import re

_TOLD = re.compile(r"([0-9]{1,19}): (.*)", re.DOTALL)  # no stamp has more digits, and int() raises at 4301
NOTHING = (-1, "")


def told_of_reference(text: str) -> tuple[int, str]:
    """Return the stamp of a reference [ns] and what is said of it; ``NOTHING`` where there is none."""
    found = _TOLD.fullmatch(text)
    return (int(found[1]), found[2]) if found else NOTHING
