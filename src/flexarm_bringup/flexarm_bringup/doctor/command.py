"""Look at everything that keeps a rig from running well, and say what to do.

  flexarm doctor             machine, installation, running graph
  flexarm doctor --offline   without listening to the graph
  flexarm doctor --json -    the same for programs

Of the installation: executables, folders for log files and compiled code, middleware and its profiles,
domain, discovery (range, peers, ROS_LOCALHOST_ONLY), security (settings, keys of every enclave, libraries).

Exit codes: 0 all is well or there are only hints, 1 something does not work.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

from flexarm_bringup.arguments import STDOUT, folder, output_file
from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.doctor.installation import look_at_installation
from flexarm_bringup.doctor.machine import look_at_machine
from flexarm_bringup.doctor.shared_memory import look_at_shared_memory
from flexarm_bringup.processes.surroundings import has_domain

NEEDED = ("middleware", "security")  # rcl or we refuse to listen where one has a fault
GRAPH = "flexarm_bringup.doctor.graph_node"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("--offline", action="store_true", help="do not listen to the graph")
    parser.add_argument("--folder", type=folder, default=Path(), help="where logs and bags go; here")
    parser.add_argument(
        "--json", type=output_file, metavar="FILE", help="write the findings there; - for stdout, alone"
    )


def run(args: argparse.Namespace) -> int:
    """Print findings as they are made; return 1 when one is a fault."""
    is_quiet = args.json == STDOUT
    found = list(_told(_look(args), is_quiet))
    if args.json:
        text = json.dumps([asdict(item) for item in found], indent=1) + "\n"
        if is_quiet:
            sys.stdout.write(text)
        else:
            args.json.write_text(text, encoding="utf-8")
    faults = sum(item.verdict == "FAULT" for item in found)
    if not is_quiet:
        hints = sum(item.verdict == "hint" for item in found)
        print(f"\n{len(found)} things looked at, {faults} fault(s), {hints} hint(s)")
    return 1 if faults else 0


def _look(args: argparse.Namespace) -> Iterator[Finding]:
    yield from look_at_machine(args.folder)
    yield from look_at_shared_memory()
    is_unheard = args.offline or not has_domain()
    for item in look_at_installation():
        is_unheard |= item.verdict == "FAULT" and item.subject in NEEDED
        yield item
    if not is_unheard:
        yield from _look_at_graph()


def _look_at_graph() -> Iterator[Finding]:
    """Yield what a process of its own hears: rcl ends one as it likes, and with it what was found so far."""
    command = [sys.executable, "-m", GRAPH]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        yield Finding("FAULT", "graph", f"cannot be listened to: {last}", "what ROS says is what to mend")
        return
    yield from (Finding(**item) for item in json.loads(done.stdout))


def _told(findings: Iterable[Finding], is_quiet: bool) -> Iterator[Finding]:
    for item in findings:
        if not is_quiet:
            print(f"{item.verdict:5}  {item.subject:16} {item.text}", flush=True)
            if item.cure:
                print(f"{'':24}-> {item.cure}")
        yield item
