"""Long work announces itself: on the terminal of a command, of a node and of a worker process alike."""

from __future__ import annotations

import logging


def announce_on_stderr() -> None:
    """Print what the libraries have to say of long work (compiling a large arm) to stderr."""
    logging.basicConfig(format="flexarm: %(message)s")
    logging.getLogger("flexarm").setLevel(logging.INFO)
