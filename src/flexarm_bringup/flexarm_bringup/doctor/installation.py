"""What is installed and how it is told where to find each other: packages, domain, discovery, security."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.installed import find_executable
from flexarm_bringup.processes.graph import rig_graph
from flexarm_model.process.ros_arguments import domain
from flexarm_model.process.security import (
    KEYSTORE,
    TOOLS,
    SecurityError,
    check_security,
    is_security_asked_for,
    with_enclave,
)

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
RANGES = {
    "LOCALHOST": "this machine only",
    "SUBNET": "anybody on the net may see and command this rig",
    "OFF": "nodes do not find each other, not even on this machine",
    "SYSTEM_DEFAULT": "settings of the middleware say who may see and command this rig",
}
DOMAINS = range(0, 102)  # those whose ports leave the ephemeral ones of Linux alone


def look_at_installation(environment: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    """Yield whether the nodes can be started and will find each other."""
    for process in rig_graph(bag="bag"):
        yield _executable(process.package, process.executable, environment)
    yield _domain(environment)
    yield _range(environment)
    yield look_at_security(environment)


def _executable(package: str, executable: str, environment: Mapping[str, str]) -> Finding:
    try:
        path = find_executable(package, executable, environment)
    except FileNotFoundError as error:
        return Finding("FAULT", executable, str(error), "./flexarm build, or source install/setup.bash")
    return Finding("ok", executable, str(path))


def _domain(environment: Mapping[str, str]) -> Finding:
    cure = f"take {DOMAINS.start} to {DOMAINS.stop - 1}"
    try:
        value = domain(environment)
    except ValueError as error:
        return Finding("FAULT", "domain", str(error), cure)
    if int(value) in DOMAINS:
        return Finding("ok", "domain", f"ROS_DOMAIN_ID {value}")
    why = f"ROS_DOMAIN_ID {value}: its ports may be in use, they are among those that Linux gives to others"
    return Finding("FAULT", "domain", why, cure)


def _range(environment: Mapping[str, str]) -> Finding:
    value = environment.get(RANGE) or "SUBNET"
    if value == "LOCALHOST":
        return Finding("ok", "discovery", RANGES[value])
    if value not in RANGES:
        expected = f"expected {', '.join(RANGES)}; ROS takes it for LOCALHOST"
        return Finding("FAULT", "discovery", f"{RANGE}: '{value}': {expected}", f"export {RANGE}=LOCALHOST")
    cure = f"export {RANGE}=LOCALHOST, unless nodes run on several machines"
    if value == "OFF":
        cure = f"export {RANGE}=LOCALHOST, or SUBNET where nodes run on several machines"
    return Finding("FAULT" if value == "OFF" else "hint", "discovery", f"{value}: {RANGES[value]}", cure)


def look_at_security(environment: Mapping[str, str] = os.environ) -> Finding:
    """Return whether a tool such as this one gets the security that is asked for."""
    if not is_security_asked_for(environment):
        return Finding("ok", "security", "not asked for")
    try:
        check_security(with_enclave((), TOOLS, environment), environment)
    except SecurityError as error:
        means, _, cure = str(error).partition("; ")
        return Finding("FAULT", "security", means, cure)
    return Finding("ok", "security", f"keys in {environment[KEYSTORE]}, enforced")
