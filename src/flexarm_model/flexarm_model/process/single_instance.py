"""One node of a name per ROS domain on this machine: the second one is refused.

The name is held by a lock on a file that the kernel gives back when the process ends, however it ends. The
graph of ROS would not do: it shows a killed node for ten seconds more, and its successor could not start.

A name belongs to a process: who claims it again within the same one gets what is held already.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from pathlib import Path
from typing import TextIO
from weakref import WeakValueDictionary

_HELD: WeakValueDictionary[Path, TextIO] = WeakValueDictionary()  # by this process, as the kernel sees it


class NameTakenError(RuntimeError):
    """A node of this name is running; the text says which, and what to do."""


def claim_name(name: str, domain: str, folder: Path | None = None, kind: str = "node") -> TextIO:
    """Claim a node's full name; it is held as long as the returned file is open.

    Args:
        name: Full name, "/flexarm/controller".
        domain: ROS domain.
        folder: Of the locks; None for the user's own in the folder of temporary files.
        kind: What else has the name, for the message.

    Raises:
        NameTakenError: Another process holds it.
    """
    folder = folder or Path(tempfile.gettempdir()) / f"flexarm-{os.getuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    place = folder / f"{domain}{name.replace('/', '.')}.lock"
    before = _HELD.get(place)
    if before is not None and not before.closed:
        return before
    held = place.open("a+", encoding="utf-8")
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        held.seek(0)
        owner = held.read().strip() or "unknown"
        held.close()
        raise NameTakenError(
            f"{kind} {name} runs already in ROS domain {domain} (process {owner}): end it first, or use "
            "another ROS_DOMAIN_ID or namespace"
        ) from None
    held.truncate(0)
    held.write(str(os.getpid()))
    held.flush()
    _HELD[place] = held
    return held
