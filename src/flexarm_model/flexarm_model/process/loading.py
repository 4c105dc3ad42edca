"""Libraries that a node needs now and then, loaded in a thread beside its first work.

A node says its first word without them and is ready when they are there, so that nothing has to wait for them
in a motion. What asks for one before waits in its own ``import`` statement, as always.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from threading import Thread, get_native_id

from flexarm_model.process.punctual import be_ordinary

_SLICE = 5e-4  # s that the thread keeps the interpreter while a callback waits; usually it is 5 ms


class Loading:
    """Loads modules, one after the other."""

    def __init__(
        self, modules: Sequence[str], nice: int = 0, then: Callable[[], None] = lambda: None
    ) -> None:
        """Begin.

        Args:
            modules: By their full names.
            nice: Of the thread, nice(2); Linux keeps it for each thread.
            then: Called in the same thread when they are there.
        """
        self._thread = Thread(target=_load, args=(tuple(modules), nice, then), name="loading", daemon=True)
        self._thread.start()

    @property
    def is_done(self) -> bool:
        """Whether all are there."""
        return not self._thread.is_alive()

    def wait(self) -> None:
        """Wait until all are there."""
        self._thread.join()


def _load(modules: Sequence[str], nice: int, then: Callable[[], None]) -> None:
    be_ordinary()  # an urgent node's thread would keep others from its core until all is loaded
    if nice:
        os.setpriority(os.PRIO_PROCESS, get_native_id(), nice)
    usual = sys.getswitchinterval()
    sys.setswitchinterval(_SLICE)
    try:
        for module in modules:
            import_module(module)
        then()
    finally:
        sys.setswitchinterval(usual)
    gc.freeze()  # what was loaded stays: collections need not look at it
