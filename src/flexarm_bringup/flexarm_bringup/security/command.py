"""Write DDS-Security policies for the nodes: each in an enclave of its own, with what it uses and no more.

The graph is started for a few seconds in a ROS domain of its own and every node is asked what it publishes,
hears, offers and calls; so the policies cannot fall behind the code. Covered are all that flexarm rig and the
launch file start, who watches them, commander and excite; echo, monitor and doctor share the enclave
/flexarm/tools, call, arm, stop and goto /flexarm/operator. Not covered: composed_node, and what is not of
flexarm (RViz, PlotJuggler, ros2). Drills and measurements (faults --system, soak, realtime, demo with nodes,
identify rig --nodes, this command) run nodes in domains of their own and end with code 2 under
ROS_SECURITY_ENABLE=true.

Then it says which commands make keys and permissions of them on the rig. Whether DDS enforces them cannot be
tried where its security libraries are missing (the wheels have none). With ROS_SECURITY_ENABLE=true every
node and tool ends with code 2 unless ROS_SECURITY_STRATEGY=Enforce, a keystore with its enclave and the
libraries are there; doctor tells it as a fault.
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
from flexarm_bringup.installed import find_executable
from flexarm_bringup.processes.graph import Process, rig_graph, ros_arguments, with_drift, with_markers
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
IDLE = ("commander", "excite")  # they would move the arm


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
    for enclave in dict.fromkeys(node.enclave for node in nodes):
        alone = policy([node for node in nodes if node.enclave == enclave])
        (args.folder / f"{Path(enclave).name}.policy.xml").write_text(alone, encoding="utf8")
    print(_told(args.folder, nodes))
    return OK


def access_of_graph(manipulator: str, preset: str) -> tuple[NodeAccess, ...]:
    """Run the graph with all that may be beside it in a domain of its own; return what its nodes use.

    Raises:
        TimeoutError: Its nodes did not become ready.
    """
    from flexarm_bringup.demo_run.sessions import free_domains
    from flexarm_bringup.security.access_node import access_of  # only it needs ROS

    progress, end = Progress(), time.monotonic() + PATIENCE
    with ExitStack() as stack:
        stack.enter_context(patch.dict(os.environ, ROS_DOMAIN_ID=str(next(free_domains())), **defaults()))
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="flexarm_security_")))
        graph = with_drift(with_markers(rig_graph(manipulator, preset, bag=str(folder / "bag"))))
        names = tuple(row.name for row in graph)
        rows = (*graph, *_idle(manipulator, preset, names))
        supervisor = stack.enter_context(Supervisor(rows, folder / "log", command=_command))

        def is_late() -> bool:
            """Say whether to wait no longer."""
            return time.monotonic() > end or bool(supervisor.failed())

        def idle() -> list[str]:
            """Return who is made only, but for those that an arm cannot have."""
            return [name for name in IDLE if name not in supervisor.exit_codes()]

        return access_of(names, idle, is_late, lambda text: progress.say(f"asking the nodes: {text}"))


def _idle(manipulator: str, preset: str, partners: tuple[str, ...]) -> list[Process]:
    """Return the nodes that would move the arm."""
    given = {"manipulator": manipulator, "preset": preset, "partners": partners}
    return [Process("flexarm_bringup", f"{name}_node", name, given, essential=False) for name in IDLE]


def _command(process: Process) -> list[str]:
    """Return how a node is started; one that would move the arm is only made."""
    if process.name in IDLE:
        return [
            sys.executable,
            "-m",
            "flexarm_bringup.security.idle_node",
            process.name,
            *ros_arguments(process),
        ]
    return [str(find_executable(process.package, process.executable)), *ros_arguments(process)]


def _told(folder: Path, nodes: tuple[NodeAccess, ...]) -> str:
    store, domain = folder / "keystore", os.environ.get("ROS_DOMAIN_ID") or 0
    enclaves = dict.fromkeys(node.enclave for node in nodes)
    rights = sum(len(n.publish) + len(n.subscribe) + len(n.reply) + len(n.request) for n in nodes)
    lines = [
        f"{len(enclaves)} enclaves, {rights} rights: {folder / POLICY}",
        "on the rig, where ros2 security (sros2) and the security libraries of the DDS are installed:",
        f"  export ROS_DOMAIN_ID={domain}     # the rig's: permissions hold in no other",
        f"  ros2 security create_keystore {store}",
    ]
    for enclave in enclaves:
        lines.append(f"  ros2 security create_enclave {store} {enclave}")
        lines.append(f"  ros2 security create_permission {store} {enclave} {folder / POLICY}")
    lines += [f"{name}: not for this arm, no enclave" for name in IDLE if name not in {n.name for n in nodes}]
    lines += [
        f"  export ROS_SECURITY_KEYSTORE=$(realpath {store})     # nodes may start in any folder",
        "  export ROS_SECURITY_ENABLE=true ROS_SECURITY_STRATEGY=Enforce",
        "an enclave without its create_permission may do anything",
        "leave out who is not needed: commander, excite and operator may move the arm",
        "then flexarm rig, the launch file, a node alone, echo, monitor, doctor, call, arm, stop, goto: each",
        "goes into its enclave. Not covered: composed_node, RViz, ros2 topic and the like",
        "no DDS has enforced them here: check on the rig that a node without keys hears nothing",
    ]
    return "\n".join(lines)
