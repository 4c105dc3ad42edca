"""How every executable starts: its name is claimed before what takes long is loaded.

Libraries and messages take a node a second or more to load, beside others several. A console script therefore
calls a function of its package's ``executables.py``, which imports nothing but this file. The node itself
claims its name again, once rcl has told it; what the process holds already is given to it then.

A process that was started as a reserve loads first and claims when it is called (``reserve``). One that was
given a line to who started it lets go of it when it ends (``life_line``); one of a launch file ends with
``ros2 launch`` (``parent``). Where the user says nothing, nodes find each other on this machine only. Where
he asks for security that cannot be had nothing is started (``security``).
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module

from flexarm_model.process.life_line import hold_until_the_end, take_line
from flexarm_model.process.parent import end_with_parent
from flexarm_model.process.reserve import is_reserve, stand_by
from flexarm_model.process.ros_arguments import asks_help, domain, node_name
from flexarm_model.process.security import SecurityError, check_security, with_enclave
from flexarm_model.process.single_instance import NameTakenError, claim_name

NAMESPACE = "flexarm"
EXIT_CONFIGURATION, EXIT_NAME_TAKEN = 2, 3
STOPPING = (signal.SIGINT, signal.SIGTERM)
DISCOVERY_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


def run_executable(module: str, nodes: Sequence[str]) -> int:
    """Run the ``main`` of a module unless a node of the same name runs already.

    Args:
        module: Where ``main`` is.
        nodes: Names of its nodes, before they are renamed.

    Returns:
        Exit code: 0 for help, 2 when there is no such ROS domain or no security, 3 when a name is taken, else
        that of ``main``.
    """
    for number in STOPPING:
        signal.signal(number, signal.SIG_DFL)  # as long as nothing moves a signal ends the process at once
    if asks_help(sys.argv[1:]):
        print(import_module("flexarm_model.process.node_help").node_help(module), end="")
        return 0
    full = [node_name(node, NAMESPACE, sys.argv) for node in nodes]
    sys.argv[:] = with_enclave(sys.argv, full[0])
    try:
        check_security(sys.argv)
    except SecurityError as error:
        return _refused(module, error)
    os.environ[DISCOVERY_RANGE] = os.environ.get(DISCOVERY_RANGE) or "LOCALHOST"
    end_with_parent()
    line = take_line()
    if line is not None:
        if is_reserve() and not stand_by(module, line):
            return 0
        hold_until_the_end(line)
    held = []
    try:
        for name in full:
            held.append(claim_name(name, domain(os.environ)))
    except (ValueError, NameTakenError) as error:
        return _refused(module, error)
    return int(import_module(module).main())


def _refused(module: str, error: Exception) -> int:
    print(f"{module.rpartition('.')[2]}: {error}", file=sys.stderr)
    return EXIT_NAME_TAKEN if isinstance(error, NameTakenError) else EXIT_CONFIGURATION
