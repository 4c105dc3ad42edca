"""Does every tolerance of a case hold for a field? A bound tightened with a slip would stay loose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase

from rosbags.typesys.store import Typestore

from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.regress.case import EXPECT_FILE, Case
from flexarm_bringup.regress.playing import MODEL
from flexarm_bringup.replaying.replay_bag import DEBUG, WRITTEN
from flexarm_bringup.topics import find_stream
from flexarm_model.settings.strict_yaml import ConfigError

SIMILAR, NEAR = 3, 0.75  # fields that a message names at most; how alike they are [1]


def check_tolerances(case: Case) -> None:
    """Check that every tolerance is the first that fits some field which is compared.

    Raises:
        ConfigError: One fits none, or only fields that those before it fit; the message names file, key,
            pattern and what is allowed.
    """
    fields = compared_fields()
    free = set(fields)
    for index, pattern in enumerate(tolerance.pattern for tolerance in case.tolerances):
        fitting = [name for name in fields if fnmatchcase(name, pattern)]
        place = f"{case.folder / EXPECT_FILE}: tolerances.{index}.field: '{pattern}'"
        if not fitting:
            allowed = _allowed(pattern, fields)
            raise ConfigError(f"{place}: fits no field that is compared; expected {allowed}")
        if free.isdisjoint(fitting):
            said = "those before it fit each of its fields, and the first that fits holds"
            raise ConfigError(f"{place}: {said}; expected it before them, or not at all")
        free.difference_update(fitting)


def compared_fields() -> tuple[str, ...]:
    """Return all fields that a case may compare, as "topic.field": relative topic, no indices."""
    streams = (find_stream(MODEL), *WRITTEN, DEBUG)
    store = bag_types()
    return tuple(
        f"{stream.topic}.{name}" for stream in streams if stream for name in _fields_of(stream.type, store)
    )


def _fields_of(kind: str, store: Typestore) -> Iterator[str]:
    """Yield the fields of a message type and of the messages in it, "header.stamp.sec"."""
    for name, (form, content) in store.get_msgdef(kind).fields:
        element = content[0][1] if form.name in ("ARRAY", "SEQUENCE") else content
        if isinstance(element, str):  # another message
            yield from (f"{name}.{inner}" for inner in _fields_of(element, store))
        else:
            yield name


def _allowed(pattern: str, fields: Sequence[str]) -> str:
    """Return what a pattern may be, and which fields are called nearly so, in words."""
    topics = ", ".join(dict.fromkeys(name.partition(".")[0] for name in fields))
    close = get_close_matches(pattern, fields, SIMILAR, NEAR)
    near = f"; such as {', '.join(close)}" if close else ""
    return f'"topic.field" without indices, * for anything, of {topics}{near}'
