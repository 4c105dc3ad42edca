"""Write DDS-Security policies for the nodes: each in an enclave of its own, with what it uses and no more.

The graph is started for a few seconds in a ROS domain of its own and every node is asked what it publishes,
hears, offers and calls; so the policies cannot fall behind the code. Then it says which commands make keys
and permissions of them on the rig. Whether DDS enforces them cannot be tried where its security libraries are
missing (the wheels have none); with ROS_SECURITY_ENABLE=true nodes then end with code 2.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from flexarm_bringup.arguments import output_folder
from flexarm_bringup.processes.graph import enclave_of, rig_graph
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.processes.surroundings import defaults
from flexarm_bringup.progress import Progress
from flexarm_bringup.security.policy import NodeAccess, policy
from flexarm_model.settings.strict_yaml import ConfigError

EPILOG = """\
examples:
  flexarm security keys                  policies of the single link's nodes in keys/
  flexarm security keys planar_3rrr      of another arm: it has other sensors
"""
OK, FAILED, REFUSED = 0, 1, 2
PATIENCE = 120.0  # s until all nodes are ready
POLICY = "flexarm.policy.xml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("folder", type=output_folder, help="gets the policies; the keystore goes there, too")
    parser.add_argument("manipulator", nargs="?", default="single_link", help="name or .yaml of the arm")
    parser.epilog = EPILOG


def run(args: argparse.Namespace) -> int:
    """Ask, write, tell; returns the exit code."""
    from flexarm_bringup.tasks.task_for import task_for

    try:
        preset = task_for(args.manipulator).presets[0]
        args.folder.mkdir(parents=True, exist_ok=True)
        nodes = access_of_graph(args.manipulator, preset)
    except (ConfigError, OSError) as error:
        print(f"flexarm security: {error}", file=sys.stderr)
        return FAILED if isinstance(error, TimeoutError) else REFUSED
    (args.folder / POLICY).write_text(policy(nodes), encoding="utf8")
    for node in nodes:
        (args.folder / f"{node.name}.policy.xml").write_text(policy((node,)), encoding="utf8")
    print(_told(args.folder, nodes))
    return OK


def access_of_graph(manipulator: str, preset: str) -> tuple[NodeAccess, ...]:
    """Run the graph with a recorder in a domain of its own; return what its nodes use.

    Raises:
        TimeoutError: Its nodes did not become ready.
    """
    from flexarm_bringup.demo_run.sessions import free_domains
    from flexarm_bringup.security.access_node import access_of

    progress, end = Progress(), time.monotonic() + PATIENCE
    with ExitStack() as stack:
        stack.enter_context(patch.dict(os.environ, ROS_DOMAIN_ID=str(next(free_domains())), **defaults()))
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="flexarm_security_")))
        graph = rig_graph(manipulator, preset, bag=str(folder / "bag"))
        supervisor = stack.enter_context(Supervisor(graph, folder / "log"))
        names = tuple(row.name for row in graph)

        def is_late() -> bool:
            """Say whether to wait no longer."""
            return time.monotonic() > end or bool(supervisor.failed())

        return access_of(names, is_late, lambda text: progress.say(f"asking the nodes: {text}"))


def _told(folder: Path, nodes: tuple[NodeAccess, ...]) -> str:
    store = folder / "keystore"
    rights = sum(len(n.publish) + len(n.subscribe) + len(n.reply) + len(n.request) for n in nodes)
    lines = [
        f"{len(nodes)} enclaves, {rights} rights: {folder / POLICY}",
        "on the rig, where ros2 security (sros2) and the security libraries of the DDS are installed:",
        f"  ros2 security create_keystore {store}",
    ]
    for node in nodes:
        lines.append(f"  ros2 security create_enclave {store} {enclave_of(node.name)}")
        lines.append(f"  ros2 security create_permission {store} {enclave_of(node.name)} {folder / POLICY}")
    lines += [
        f"  export ROS_SECURITY_KEYSTORE={store}",
        "  export ROS_SECURITY_ENABLE=true ROS_SECURITY_STRATEGY=Enforce",
        "then flexarm rig or the launch file: they start every node in its enclave",
        "no DDS has enforced them here: check on the rig that a node without keys hears nothing",
    ]
    return "\n".join(lines)
