"""What is raised where a worker process is lost; apart from the pool, whose libraries take time to load."""

from __future__ import annotations


class WorkerError(ValueError):
    """A worker process ended before its job did: nothing is known of what it was to find."""
