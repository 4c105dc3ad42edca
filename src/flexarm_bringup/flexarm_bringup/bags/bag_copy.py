"""A bag written anew: fewer messages, perhaps, but every topic with its type and the QoS it was offered."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag
from flexarm_bringup.bags.bag_writer import BagWriter, whole_or_nothing
from flexarm_bringup.bags.described_arm import kept_files
from flexarm_bringup.topics import Stream, find_stream

OTHER = "other"  # publisher of a topic that is not in the table


def copy_bag(bag: Bag, folder: Path, records: Iterable[Record]) -> Bag:
    """Write some messages of a bag into a new one and return it; topics without messages stay.

    Args:
        bag: Where they are from, whatever its storage and version.
        folder: To create.
        records: The messages, by log time.

    Raises:
        BagError: ``folder`` exists or cannot be written, or nothing was left; then it is not there.
    """
    streams = [
        find_stream(topic.name) or Stream(topic.name, topic.type, OTHER, "", "") for topic in bag.topics
    ]
    offered = {topic.name: topic.qos for topic in bag.topics}
    with whole_or_nothing(folder):
        with BagWriter(folder, streams, bag.custom, offered, kept_files(bag.path)) as writer:
            for record in records:
                writer.write(record.name, record.log_time_ns, record.cdr)
        return check_bag(folder)
