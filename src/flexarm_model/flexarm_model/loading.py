"""Libraries that a node needs now and then, loaded in a thread beside its first work.

A node says its first word without them and is ready when they are there, so that nothing has to wait for them
in a motion. What asks for one before waits in its own ``import`` statement, as always.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence
from importlib import import_module
from threading import Thread

_SLICE = 5e-4  # s that the thread keeps the interpreter while a callback waits; usually it is 5 ms


class Loading:
    """Loads modules, one after the other."""

    def __init__(self, modules: Sequence[str]) -> None:
        """Begin."""
        self._thread = Thread(target=_load, args=(tuple(modules),), name="loading", daemon=True)
        self._thread.start()

    @property
    def is_done(self) -> bool:
        """Whether all are there."""
        return not self._thread.is_alive()


def _load(modules: Sequence[str]) -> None:
    usual = sys.getswitchinterval()
    sys.setswitchinterval(_SLICE)
    try:
        for module in modules:
            import_module(module)
    finally:
        sys.setswitchinterval(usual)
    gc.freeze()  # what was loaded stays: collections need not look at it
