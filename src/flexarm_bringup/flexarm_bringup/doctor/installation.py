"""What is installed, and what the environment makes of it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.doctor.keys import look_at_security
from flexarm_bringup.doctor.middleware import look_at_middleware
from flexarm_bringup.doctor.network import look_at_network
from flexarm_bringup.doctor.places import look_at_places
from flexarm_bringup.installed import find_executable
from flexarm_bringup.processes.graph import rig_graph


def look_at_installation(environment: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    """Yield whether the nodes can be started and will find each other."""
    for process in rig_graph(bag="bag"):
        yield _executable(process.package, process.executable, environment)
    yield from look_at_places(environment)
    middleware = [*look_at_middleware(environment)]
    yield from middleware
    yield from look_at_network(environment)
    has_middleware = middleware[0].verdict != "FAULT"
    yield from look_at_security(environment, has_middleware=has_middleware)


def _executable(package: str, executable: str, environment: Mapping[str, str]) -> Finding:
    try:
        path = find_executable(package, executable, environment)
    except FileNotFoundError as error:
        return Finding("FAULT", executable, str(error), "./flexarm build, or source install/setup.bash")
    return Finding("ok", executable, str(path))
