"""Who can find, see and command the rig: domain, range of discovery, machines named one by one."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.processes.surroundings import PEERS, RANGE
from flexarm_model.process.ros_arguments import domain

RANGES = {
    "LOCALHOST": "this machine only",
    "SUBNET": "anybody on the net may see and command this rig",
    "OFF": "nodes do not find each other, not even on this machine",
    "SYSTEM_DEFAULT": "settings of the middleware say who may see and command this rig",
}
WITHOUT_PEERS = ("OFF", "SYSTEM_DEFAULT")  # rmw_fastrtps 8.4, participant.cpp
LOCAL = "ROS_LOCALHOST_ONLY"  # older than the range; rcl takes only "1" for yes
DOMAINS = range(0, 102)  # those whose ports leave the ephemeral ones of Linux alone


def look_at_network(environment: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    """Yield whether nodes will find each other, and who else finds them."""
    yield _domain(environment)
    peers = [peer for peer in environment.get(PEERS, "").split(";") if peer]
    if environment.get(LOCAL) == "1":
        yield _localhost_only(environment, peers)
        return
    if not peers or environment.get(RANGE) != "LOCALHOST":
        yield _range(environment)
    if peers:
        yield _peers(environment, peers)


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


def _localhost_only(environment: Mapping[str, str], peers: list[str]) -> Finding:
    """Return what is not looked at for it (rcl 9.2.8, init.c); a fault where that says something else."""
    ignored = {PEERS: ";".join(peers)} if peers else {}
    if environment.get(RANGE) not in (None, "", "LOCALHOST"):
        ignored[RANGE] = environment[RANGE]
    text = f"{LOCAL}: '1': this machine only"
    if ignored:
        unheard = " and ".join(f"{name} '{value}'" for name, value in ignored.items())
        return Finding("FAULT", "discovery", f"{text}; ROS ignores {unheard} for it", f"unset {LOCAL}")
    return Finding(
        "hint", "discovery", f"{text}, by a deprecated name", f"unset {LOCAL}, export {RANGE}=LOCALHOST"
    )


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


def _peers(environment: Mapping[str, str], peers: list[str]) -> Finding:
    means = "may see and command this rig, on whatever net they are"
    if environment.get(RANGE) in WITHOUT_PEERS:
        means = f"are not looked for with {RANGE}={environment[RANGE]}"
    text = f"{PEERS}: {', '.join(peers)} {means}"
    return Finding("hint", "discovery", text, f"unset {PEERS}, unless nodes run there")
