"""Are there models for what is followed? The model node says so of every reference, or says nothing.

A node that is frozen says nothing: then the law would go on with the model of another pose.
"""

from __future__ import annotations

from flexarm_model.motion.told import NOTHING, told_of_reference

PATIENCE_NS = 500_000_000  # after a motion has begun; a busy machine makes its models while it moves


class ModelsAwaited:
    """Remembers what is followed, and what was said of it, whatever is said of other references since."""

    def __init__(self) -> None:
        """Begin with nothing followed."""
        self._followed_ns, self._newest, self._said = NOTHING[0], NOTHING, NOTHING
        self._is_awaited = False

    def follow(self, stamp_ns: int, is_awaited: bool) -> None:
        """Follow the reference of a stamp [ns]; of one that is not awaited nothing need be said."""
        self._followed_ns, self._is_awaited = stamp_ns, is_awaited
        self._note()  # the model node may have been quicker

    def hear(self, text: str) -> None:
        """Take what the model node says: "stamp: receipt" or "stamp: refused: reason"."""
        self._newest = told_of_reference(text)
        self._note()

    def forget(self) -> None:
        """Follow nothing that could lack models."""
        self._followed_ns = NOTHING[0]

    def missing(self, now_ns: int) -> str:
        """Return at a stamp [ns] why there are no models; empty where there are, or may still be."""
        if self._followed_ns < 0:
            return ""
        stamp_ns, words = self._said
        if stamp_ns == self._followed_ns:
            return words.removeprefix("refused: ") if words.startswith("refused: ") else ""
        is_late = self._is_awaited and now_ns > self._followed_ns + PATIENCE_NS
        return f"{1e-9 * PATIENCE_NS:g} s after its begin the model node has said nothing" if is_late else ""

    def _note(self) -> None:
        if self._newest[0] == self._followed_ns:
            self._said = self._newest
