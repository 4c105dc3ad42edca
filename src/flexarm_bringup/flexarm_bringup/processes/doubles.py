"""Refuses a graph whose nodes run already, before any process of it is started.

Each node would refuse to start by itself. But who watches the graph stops the motion when one of its nodes
ends, and there is one arm in a domain: that of the nodes that run already. Of two graphs that are
started in the same instant no node runs yet: the name of the graph itself is held by the one that was first.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TextIO

from flexarm_bringup.processes.composition import node_names
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.ros_arguments import domain
from flexarm_model.process.single_instance import claim_name


def refuse_doubles(graph: Sequence[Process], environment: Mapping[str, str] = os.environ) -> TextIO:
    """Check that no node of a graph runs on this machine, in the domain of an environment.

    Returns:
        What holds the name of the graph as long as it is open: as long as its nodes run.

    Raises:
        NameTakenError: One does; the message says which, and what to do.
    """
    held = claim_name(NAMESPACE, domain(environment), kind="graph")
    for name in node_names(graph):
        claim_name(f"{NAMESPACE}/{name}", domain(environment)).close()
    return held
