"""What was refused and why: a count for every reason, on sizes that do not grow."""

from __future__ import annotations

from collections.abc import Mapping

OTHER = "other reasons"
_MOST_REASONS = 20
_MOST_SOURCES = 100


class Tally:
    """Counts by source (a sensor, a topic) and reason."""

    def __init__(self) -> None:
        """Start with nothing."""
        self._counts: dict[str, dict[str, int]] = {}

    @property
    def counts(self) -> Mapping[str, Mapping[str, int]]:
        """Counts by source and reason; of a source, the newest reason comes last."""
        return self._counts

    def note(self, source: str, reason: str) -> None:
        """Count one refusal."""
        source = source if source in self._counts or len(self._counts) < _MOST_SOURCES else OTHER
        reasons = self._counts.setdefault(source, {})
        reason = reason if reason in reasons or len(reasons) < _MOST_REASONS else OTHER
        reasons[reason] = reasons.pop(reason, 0) + 1
