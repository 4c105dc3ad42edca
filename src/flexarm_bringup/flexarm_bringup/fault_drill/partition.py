"""A network between two halves of a rig that can be cut: Linux network namespaces joined by a cable.

One half runs in a namespace of its own, the other where the caller is; ``cut`` and ``mend`` pull and plug
the cable. Needs root and iproute2.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

NETWORK = "10.213.{}.{}/24"  # private [RFC1918]
TROUBLE = 20.0  # s; "ip" takes milliseconds


@dataclass(frozen=True)
class Partition:
    """A namespace, the near end of its cable, and the address there."""

    namespace: str
    cable: str
    address: str

    def inside(self, command: Sequence[str]) -> list[str]:
        """Return the command line that runs ``command`` in the namespace."""
        return ["ip", "netns", "exec", self.namespace, *command]

    def cut(self) -> None:
        """Pull the cable."""
        _ip("link", "set", self.cable, "down")

    def mend(self) -> None:
        """Plug it in again."""
        _ip("link", "set", self.cable, "up")


def why_not() -> str:
    """Return why no namespace can be made here; empty when one can."""
    if os.geteuid() != 0:
        return "needs root"
    if shutil.which("ip") is None:
        return "needs ip (iproute2)"
    name = f"flexarm_{os.getpid()}"
    tried = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True, timeout=TROUBLE)
    if tried.returncode:
        return f"no network namespace can be made: {tried.stderr.strip()}"
    subprocess.run(["ip", "netns", "delete", name], capture_output=True, timeout=TROUBLE)
    return ""


@contextmanager
def partition(number: int) -> Iterator[Partition]:
    """Make a namespace with a cable to it; take both away at the end.

    Args:
        number: Tells partitions of this machine apart, 0 to 255.

    Raises:
        OSError: It cannot be made; says why.
    """
    here, there = f"fa{number}h", f"fa{number}t"
    made = Partition(f"flexarm_{number}", here, NETWORK.format(number, 1).partition("/")[0])
    _ip("netns", "add", made.namespace)
    try:
        _ip("link", "add", here, "type", "veth", "peer", "name", there, "netns", made.namespace)
        _ip("addr", "add", NETWORK.format(number, 1), "dev", here)
        _ip("link", "set", here, "up")
        for words in (
            ("addr", "add", NETWORK.format(number, 2), "dev", there),
            ("link", "set", there, "up"),
            ("link", "set", "lo", "up"),
        ):
            _ip("-netns", made.namespace, *words)
        yield made
    finally:
        subprocess.run(["ip", "link", "delete", here], capture_output=True, timeout=TROUBLE)
        subprocess.run(["ip", "netns", "delete", made.namespace], capture_output=True, timeout=TROUBLE)


def _ip(*words: str) -> None:
    done = subprocess.run(["ip", *words], capture_output=True, text=True, timeout=TROUBLE)
    if done.returncode:
        raise OSError(f"ip {' '.join(words)}: {done.stderr.strip()}")
