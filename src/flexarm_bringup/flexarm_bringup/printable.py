"""Texts of messages, bags and files as a terminal may be given them: letters, none of which steers it."""

from __future__ import annotations

UNPRINTABLE = "?"  # stands for what steers a terminal, or is no character


def printable(text: str) -> str:
    """Return one line of text with as many characters, all of which can be printed."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " if c.isspace() else UNPRINTABLE for c in text)
