"""Line ends of an edited text: every line keeps its own, and new ones end as the first line does."""

from __future__ import annotations

import difflib
import io

PLAIN = "\n"


def with_line_ends_of(old: str, new: str) -> str:
    r"""Return an edited text with the line ends of what it was made of.

    Args:
        old: The text as its file holds it, whose lines may end in "\r\n", "\n" or "\r", each in its own way.
        new: The same after some edits, with "\n" throughout.
    """
    before, after = _lines(old), _lines(new)
    old_bodies, bodies = ([_body(line) for line in lines] for lines in (before, after))
    ends = [line[len(_body(line)) :] for line in before]
    usual = next(iter(ends), PLAIN) or PLAIN
    found = [usual] * len(after)
    alike = difflib.SequenceMatcher(None, old_bodies, bodies, autojunk=False)
    for _, i, i_end, j, j_end in alike.get_opcodes():
        if i_end - i == j_end - j:
            found[j:j_end] = [end or usual for end in ends[i:i_end]]
    return "".join(
        body + (end if line.endswith(PLAIN) else "")
        for body, line, end in zip(bodies, after, found, strict=True)
    )


def _lines(text: str) -> list[str]:
    """Return the lines of a text with their ends."""
    return io.StringIO(text, newline="").readlines()


def _body(line: str) -> str:
    """Return a line without its end."""
    return line.rstrip("\r\n")
