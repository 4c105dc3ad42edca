"""Rows about commands that nobody of us has sent, and about security that is asked for but not there.

Every kind of forged command is wrong in one thing only (``forged``): were the guard blind to that, it would
let them through. That it lets through those in which nothing is wrong shows that they come at the right time.
"""

from __future__ import annotations

import copy
import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.partition import partition, why_not
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.stand import Skipped
from flexarm_bringup.fault_drill.system_stand import PATIENCE, SystemStand
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.processes.surroundings import PEERS, PROFILE_VARIABLES, RANGE
from flexarm_model.process.enclave_keys import FILES
from flexarm_model.process.executable import EXIT_CONFIGURATION
from flexarm_model.process.security import ENABLE, ENFORCE, KEYSTORE, STRATEGY

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.forger_node import Outcome
    from flexarm_bringup.processes.running_graph_node import Ear

TOPICS = ("guard_status", "joint_commands", "applied_effort")
FROM_OUTSIDE = 200
SHARE = 0.37  # of the torque limit: a torque that nobody asks for at rest
ALARM = 3.0  # s until it is told
OLD = 200  # commands of a session that are sent again in the next one
EARLY = 40  # of these, before the first command of the next one
HEEDED = 0.25  # share of those with nothing wrong that is let through: they do come in time
HEARD = 0.98  # share of those to be refused that is: a few may be lost on the way to the guard
START = 20.0  # s; a node takes a second or two to start
SECURED = {ENABLE: "true", STRATEGY: ENFORCE}


def forgeries(stand: SystemStand) -> list[Finding]:
    """Send commands that are wrong in one thing, and real ones twice, while the arm is held."""
    from flexarm_bringup.fault_drill.forged import KINDS, RIGHT
    from flexarm_bringup.fault_drill.forger_node import Forger
    from flexarm_bringup.processes.running_graph_node import running

    with running(stand.graph(), TOPICS, stand.folder()) as (_, ear):
        _hold(stand, ear)
        forger, findings = Forger(stand, ear), []
        for number, kind in enumerate(KINDS):
            outcome = forger.attack(kind)
            findings += refusals(kind.name, outcome, kind.is_made_up, kind.is_told)
            if not number:
                findings.append(Finding("refusals told after", outcome.alarm, ALARM, "s"))
        right = forger.attack(RIGHT)
    return [
        *findings,
        Finding(f"{RIGHT.name}: applied of {right.sent}", right.applied, HEEDED * right.sent, at_least=True),
        Finding("the arm was stopped by them", forger.stops, 0),
    ]


def refusals(name: str, outcome: Outcome, is_made_up: bool = True, is_told: bool = True) -> list[Finding]:
    """Return what became of forged commands; the torque of a real one does not tell if it was let through."""
    findings = []
    if is_made_up:
        findings.append(Finding(f"{name}: applied of {outcome.sent}", outcome.applied, 0))
    if is_told:
        least = HEARD * outcome.sent
        findings.append(Finding(f"{name}: refused of {outcome.sent}", outcome.refused, least, at_least=True))
    return findings


def from_another_host(stand: SystemStand) -> list[Finding]:
    """Send forged commands from another host while the rig speaks on its own machine only.

    The other host looks for it on the net, and then at the address that somebody has told it.
    """
    reason = why_not()
    if reason:
        raise Skipped(reason)
    from flexarm_bringup.processes.running_graph_node import running

    forger = [sys.executable, "-m", "flexarm_bringup.fault_drill.forger_node", str(FROM_OUTSIDE)]
    found = []
    with partition(os.getpid() % 256) as net, running(stand.graph(), TOPICS, stand.folder()) as (_, ear):
        _hold(stand, ear)
        line = net.inside([*forger, *map(repr, _effort(stand))])
        for who, peers in (("from another host", ""), ("from one that knows its address", net.address)):
            said = _sent_from(line, {RANGE: "SUBNET", PEERS: peers}, ear)
            heard = sum(list(msg.effort) == _effort(stand) for msg in ear.heard["joint_commands"])
            found += [
                Finding(f"{who}: found of its listeners", float(said.split()[0]), 0),
                Finding(f"{who}: heard of {FROM_OUTSIDE}", heard, 0),
                Finding(f"{who}: applied", _applied(stand, ear), 0),
            ]
    return found


def _sent_from(line: list[str], changed: dict[str, str], ear: Ear) -> str:
    """Let a forger on the other host say all it has to say; return what it found."""
    own = {name: value for name, value in os.environ.items() if name not in PROFILE_VARIABLES}
    with subprocess.Popen(line, env={**own, **changed}, stdout=subprocess.PIPE, text=True) as sent:
        ear.wait(lambda: sent.poll() is not None, 2 * PATIENCE, "the other host")
        said = sent.communicate()[0].strip()
    if sent.returncode:
        raise RuntimeError(f"the forger on the other host ended with {sent.returncode}: {said}")
    return said


def replays(stand: SystemStand) -> list[Finding]:
    """Send the commands of a session again in the next one; ask for security that is not installed."""
    from flexarm_bringup.fault_drill.forged import Kind, with_token
    from flexarm_bringup.fault_drill.forger_node import Forger
    from flexarm_bringup.processes.running_graph_node import running

    with running(stand.graph(), TOPICS, stand.folder()) as (supervisor, ear):
        _hold(stand, ear)
        forger, token = Forger(stand, ear), ear.latest("guard_status").session_token
        old = [msg for msg in ear.heard["joint_commands"] if msg.session_token == token][-OLD:]
        _rest(ear)
        findings = refusals("of an old session, not armed", forger.repeat(old))
        with _frozen(supervisor.pids["controller"]):
            ear.wait(lambda: bool(ear.call("guard/arm").success), PATIENCE, "the guard to be armed")
            ear.wait(lambda: bool(_token(ear)), PATIENCE, "the new session")
            early = [renewed(msg, _token(ear)) for msg in old[-EARLY:]]
            findings += refusals(
                "of an old session with the new token, before any other",
                forger.repeat(early, 2.0 * stand.dt),
            )
        _rest(ear)
        stand.arm(ear)
        findings += refusals("of an old session, armed again", forger.repeat(old))
        kind = Kind("with the old token, new stamps and numbers", with_token(token), OLD)
        findings += refusals(kind.name, forger.attack(kind))
    return findings + _without_libraries(stand)


def renewed(old: Any, token: int) -> Any:
    """Return an old command as one of a new session; only its stamp tells."""
    msg = copy.deepcopy(old)
    msg.session_token = token
    return msg


def _token(ear: Ear) -> int:
    return int(ear.latest("guard_status").session_token)


def _rest(ear: Ear) -> None:
    """Stop the arm and wait until it is at rest."""
    ear.call("guard/stop")
    told = ear.heard["guard_status"]
    ear.wait(lambda: told[-1].mode == told[-1].STOPPED, PATIENCE, "rest")


@contextmanager
def _frozen(pid: int) -> Iterator[None]:
    """Hold a process."""
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)


def _without_libraries(stand: SystemStand) -> list[Finding]:
    """Ask for security without a strategy, without keys, and with keys but no libraries."""
    empty, full = stand.folder(), stand.folder()
    for row in stand.graph():
        (enclave := full / "enclaves" / "flexarm" / row.name).mkdir(parents=True)
        for name in FILES:
            (enclave / name).touch()
    cases = {
        f"{ENABLE} alone": {ENABLE: "true"},
        "no keys": {**SECURED, KEYSTORE: str(empty)},
        "no libraries": {**SECURED, KEYSTORE: str(full)},
    }
    return [
        Finding(f"security asked for, {name}: nodes that run", _insecure(stand, case), 0)
        for name, case in cases.items()
    ]


def _insecure(stand: SystemStand, asked: dict[str, str]) -> int:
    """Return how many nodes do not refuse as they should, with code 2."""
    before = {key: value for key, value in os.environ.items() if not key.startswith("ROS_SECURITY")}
    with Supervisor(stand.graph(), stand.folder(), {**before, **asked}) as supervisor:
        supervisor.wait(START)
        codes = supervisor.exit_codes()
    return sum(codes.get(row.name) != EXIT_CONFIGURATION for row in stand.graph())


def _hold(stand: SystemStand, ear: Ear) -> None:
    ear.wait_ready("rig", "guard", "estimator", "controller")
    stand.arm(ear)
    ear.wait(lambda: len(ear.heard["joint_commands"]) > OLD, PATIENCE, "commands")


def _effort(stand: SystemStand) -> list[float]:
    return [SHARE * axis.effort for axis in stand.stand.arm.config.actuated.values()]


def _applied(stand: SystemStand, ear: Ear) -> int:
    """Return how many torques that were let through come near what was forged."""
    forged = _effort(stand)
    heard: list[Any] = ear.heard["applied_effort"]
    return sum(all(x > 0.5 * y for x, y in zip(msg.effort, forged, strict=True)) for msg in heard)


def _forged_everywhere(stand: SystemStand) -> list[Finding]:
    found = forgeries(stand)
    try:
        return found + from_another_host(stand)
    except Skipped as reason:  # the row stands without its part that needs root
        return [*found, Finding(f"from another host: not done, {reason}", 0, math.inf)]


ROWS = (
    Row(49, "unauthorised publisher of commands", "none applied; refusals are told", _forged_everywhere, "N"),
    Row(50, "old commands; security without libraries", "refused; nodes do not run", replays, "N"),
)
