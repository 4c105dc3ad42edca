"""Topics of a recording on which nothing came although somebody was to speak."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from flexarm_bringup.topics import Stream


def unheard(
    streams: Iterable[Stream], counts: Mapping[str, int], nodes: Collection[str], sensors: Collection[str]
) -> list[str]:
    """Return the relative topics of which there is no message, and should be.

    Args:
        streams: That are recorded.
        counts: Messages by absolute topic [1].
        nodes: That take part.
        sensors: Relative topics of the measurements that the arm has.
    """
    awaited = (
        stream
        for stream in streams
        if stream.publisher in nodes and not stream.is_optional
        if stream.topic in sensors or not stream.is_sensor
    )
    return [stream.topic for stream in awaited if not counts.get(stream.name, 0)]
