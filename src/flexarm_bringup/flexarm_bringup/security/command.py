"""Write DDS-Security policies for the nodes: each in an enclave of its own, with what it uses and no more.

The graph is started for a few seconds in a ROS domain of its own and every node is asked what it publishes,
hears, offers and calls; so the policies cannot fall behind the code. Covered are all that flexarm rig and the
launch file start, who watches them, commander and excite; echo, monitor and doctor share the enclave
/flexarm/tools, call, arm, stop and goto /flexarm/operator. A driver of your own runs in the enclave of the
simulated rig, /flexarm/rig, and the guard may hear it on each topic that --driver names. Not covered:
composed_node, and what is not of flexarm (RViz, PlotJuggler, ros2). Drills and measurements (faults --system,
soak, realtime, demo with nodes, identify rig --nodes, this command) run nodes in domains of their own and end
with code 2 under ROS_SECURITY_ENABLE=true.

Then it says which commands make keys and permissions of them on the rig. Whether DDS enforces them cannot be
tried where its security libraries are missing (the wheels have none). With ROS_SECURITY_ENABLE=true every
node and tool ends with code 2 unless ROS_SECURITY_STRATEGY=Enforce, a keystore with its enclave and the
libraries are there; doctor tells it as a fault.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from flexarm_bringup.arguments import output_folder
from flexarm_bringup.installed import find_executable
from flexarm_bringup.processes.graph import RIG, Process, ros_arguments, with_drift, with_markers
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.processes.surroundings import defaults
from flexarm_bringup.progress import Progress
from flexarm_bringup.security.beside_driver import beside_driver
from flexarm_bringup.security.policy import NodeAccess, policy
from flexarm_bringup.tasks.node_settings import arm_graph, drift_settings
from flexarm_model.settings.strict_yaml import ConfigError

EPILOG = """\
examples:
  flexarm security keys                  policies of the single link's nodes in keys/
  flexarm security keys planar_3rrr      of another arm: it has other sensors
  flexarm security keys my_moves.yaml    of an arm with the settings of a copy of its config/moves file
"""
OK, FAILED, REFUSED = 0, 1, 2
POLICY = "flexarm.policy.xml"
IDLE = ("commander", "excite")  # they would move the arm


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("folder", type=output_folder, help="gets the policies; the keystore goes there, too")
    parser.add_argument(
        "manipulator",
        nargs="?",
        default="single_link",
        help="name or .yaml of the arm, or of its moves file; single_link",
    )
    parser.add_argument(
        "--preset", help="preset of the arm; the first that its moves are for, none without moves"
    )
    parser.epilog = EPILOG


def run(args: argparse.Namespace) -> int:
    """Ask, write, tell; returns the exit code."""
    try:
        nodes = access_of_graph(args.manipulator, args.preset)
        args.folder.mkdir(parents=True, exist_ok=True)
    except (ConfigError, OSError) as error:
        print(f"flexarm security: {error}", file=sys.stderr)
        return FAILED if isinstance(error, TimeoutError | ChildProcessError) else REFUSED
    (args.folder / POLICY).write_text(policy(nodes), encoding="utf8")
    for enclave in dict.fromkeys(node.enclave for node in nodes):
        alone = policy([node for node in nodes if node.enclave == enclave])
        (args.folder / f"{Path(enclave).name}.policy.xml").write_text(alone, encoding="utf8")
    print(_told(args.folder, nodes))
    return OK


def access_of_graph(arm: str, preset: str | None = None) -> tuple[NodeAccess, ...]:
    """Run the graph with all that may be beside it in a domain of its own; return what its nodes use.

    Args:
        arm: Name or YAML file, also a moves file.
        preset: Of it; None: the first that its moves are for.

    Raises:
        ConfigError: There is no such arm or preset.
        ChildProcessError: One of its nodes has ended; the text says with what code and last words.
        TimeoutError: Its nodes did not become ready.
    """
    from flexarm_bringup.demo_run.sessions import free_domains
    from flexarm_bringup.security.access_node import access_of  # only it needs ROS

    progress = Progress()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="flexarm_security_")))
        graph = with_markers(arm_graph(arm, preset, bag=str(folder / "bag")))
        graph = with_drift(graph, drift_settings(arm, preset))
        stack.enter_context(patch.dict(os.environ, ROS_DOMAIN_ID=str(next(free_domains())), **defaults()))
        needed = [replace(row, essential=True) for row in graph]  # also who cannot stop the motion
        names = tuple(row.name for row in graph)
        supervisor = stack.enter_context(
            Supervisor([*needed, *_idle(graph)], folder / "log", command=_command)
        )

        def idle() -> list[str]:
            """Return who is made only, but for those that an arm cannot have."""
            return [name for name in IDLE if name not in supervisor.exit_codes()]

        nodes = access_of(
            names, idle, supervisor.failed, lambda text: progress.say(f"asking the nodes: {text}")
        )
    return beside_driver(nodes, graph)


def _idle(graph: Sequence[Process]) -> list[Process]:
    """Return the nodes that would move the arm."""
    shared = next(row for row in graph if row.name == RIG).parameters
    given = {key: shared[key] for key in ("manipulator", "preset")}
    given["partners"] = tuple(row.name for row in graph)
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
