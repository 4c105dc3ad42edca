"""Publishers and subscribers of a topic that do not mean the same type of message: DDS connects none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.topics import find_stream

SUBJECT = "type"


@dataclass(frozen=True)
class End:
    """A publisher or a subscriber of a topic.

    Attributes:
        node: Name of its node.
        type: Of its messages, "package/msg/Name".
    """

    node: str
    type: str


def find_mistyped(topic: str, publishers: Sequence[End], subscribers: Sequence[End]) -> Iterator[Finding]:
    """Yield whoever does not take a topic for what it is, after the table of streams.

    Of a topic that the table does not have, every publisher and subscriber that differ are named.

    Args:
        topic: Absolute name.
        publishers: Of that topic.
        subscribers: Of that topic.
    """
    stream = find_stream(topic)
    if stream is None:
        yield from _find_unlike(topic, publishers, subscribers)
        return
    for does, ends in (("publishes", publishers), ("takes", subscribers)):
        for end in ends:
            if end.type != stream.type:
                text = f"{topic}: {end.node} {does} {end.type}; the topic is for {stream.type}"
                yield Finding("FAULT", SUBJECT, text, "take that type: DDS connects no two that differ")


def _find_unlike(topic: str, publishers: Sequence[End], subscribers: Sequence[End]) -> Iterator[Finding]:
    for offer in publishers:
        for wish in subscribers:
            if offer.type != wish.type:
                text = f"{topic}: {wish.node} gets nothing from {offer.node}"
                cure = f"make them fit: subscriber {wish.type}, publisher {offer.type}"
                yield Finding("FAULT", SUBJECT, text, cure)
