"""Refuses a graph that would not get the security it is asked for, before any process of it is started."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from flexarm_bringup.processes.graph import Process
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.security import (
    OFF,
    SecurityError,
    check_security,
    is_security_asked_for,
    with_enclave,
)

OPERATOR = f"{NAMESPACE}/operator"  # enclave of tools that command
WATCH, LOOK = "watch", "look"  # nodes of who starts the graph: stops the motion; looks for a second driver
WATCH_ENCLAVE = f"{NAMESPACE}/{WATCH}"  # of both


def check_graph_security(graph: Sequence[Process], environment: Mapping[str, str] = os.environ) -> None:
    """Check that there are keys for every node of a graph and for who watches it, where they are asked for.

    Raises:
        SecurityError: There are none; the message says for whom, and what to do. Or nodes are to share a
            process, which has one enclave: no policy is for two of them.
    """
    shared = next((process for process in graph if process.members), None)
    if shared and is_security_asked_for(environment):
        both = " and ".join(shared.nodes)
        raise SecurityError(f"{both} in one process: no enclave is for both; start them apart, {OFF}")
    for name in (WATCH, *(process.name for process in graph)):
        check_security(with_enclave((), f"{NAMESPACE}/{name}", environment), environment)
