"""Refuses a graph whose nodes run already, before any process of it is started.

Each node would refuse to start by itself. But who watches the graph stops the motion when one of its nodes
ends, and there is one arm in a domain: that of the nodes that run already.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from flexarm_bringup.processes.composition import node_names
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.ros_arguments import domain
from flexarm_model.process.single_instance import claim_name


def refuse_doubles(graph: Sequence[Process], environment: Mapping[str, str] = os.environ) -> None:
    """Check that no node of a graph runs on this machine, in the domain of an environment.

    Raises:
        NameTakenError: One does; the message says which, and what to do.
    """
    for name in node_names(graph):
        claim_name(f"{NAMESPACE}/{name}", domain(environment)).close()
