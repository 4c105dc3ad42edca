"""Are there models for what is followed? The model node says so of every reference, or says nothing.

A node that is frozen says nothing: then the law would go on with the model of another pose.
"""

from __future__ import annotations

from flexarm_model.motion.told import NOTHING, told_of_reference

PATIENCE_NS = 500_000_000  # after a motion has begun; a busy machine makes its models while it moves


class ModelsAwaited:
    """Remembers what is followed or waits for its begin, and what was said of it."""

    def __init__(self) -> None:
        """Begin with nothing followed."""
        self._followed: list[tuple[int, bool]] = []  # stamp [ns] and whether it is awaited, in order
        self._said: dict[int, str] = {}
        self._newest = NOTHING

    def follow(self, stamp_ns: int, is_awaited: bool) -> None:
        """Follow a reference from its stamp on [ns]; of one that is not awaited nothing need be said."""
        earlier = [known for known in self._followed if known[0] < stamp_ns]
        self._followed = [*earlier, (stamp_ns, is_awaited)]
        self._note()  # the model node may have been quicker

    def hear(self, text: str) -> None:
        """Take what the model node says: "stamp: receipt" or "stamp: refused: reason"."""
        self._newest = told_of_reference(text)
        self._note()

    def forget(self) -> None:
        """Follow nothing that could lack models."""
        self._followed.clear()

    def missing(self, now_ns: int) -> str:
        """Return at a stamp [ns] why there are no models; empty where there are, or may still be."""
        begun = [stamp_ns for stamp_ns, _ in self._followed if stamp_ns <= now_ns]
        self._followed = [known for known in self._followed if known[0] >= max(begun, default=0)]
        for stamp_ns, is_awaited in self._followed:
            words = self._said.get(stamp_ns, "")
            if words.startswith("refused: "):
                return words.removeprefix("refused: ")
            if is_awaited and not words and now_ns > stamp_ns + PATIENCE_NS:
                return f"{1e-9 * PATIENCE_NS:g} s after its begin the model node has said nothing"
        return ""

    def _note(self) -> None:
        stamps = [stamp_ns for stamp_ns, _ in self._followed]
        said = {**self._said, self._newest[0]: self._newest[1]}
        self._said = {stamp_ns: said[stamp_ns] for stamp_ns in stamps if stamp_ns in said}
