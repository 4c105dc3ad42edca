"""One run of the whole graph of processes over DDS: start, command, wait, stop, read the bag."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from flexarm_bringup.bags.run_bag import read_run
from flexarm_bringup.processes.graph import Process, rig_graph
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.record import RunRecord

POLL_PERIOD = 0.05  # s
PATIENCE = 180.0  # s, longest session


class SessionError(RuntimeError):
    """A run over DDS did not come to its end; the message says why."""


@dataclass(frozen=True)
class Session:
    """What to run.

    Attributes:
        folder: Gets the bag and the log files.
        preset: Preset of the manipulator.
        lockstep: By messages, or by the clock.
        angles: Of the moves, out and back each [deg].
        out: Motion on the way out.
        back: Motion on the way back.
        settings: Parameters of the nodes that are not defaults, by node name.
        manipulator: Name or file.
        reference: File with a reference to follow instead of the moves.
        preparation: Time between sending the reference and its start, in real time [s].
    """

    folder: Path
    preset: str
    lockstep: bool
    angles: tuple[float, ...]
    out: str
    back: str
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    manipulator: str = "single_link"
    reference: Path | None = None
    preparation: float = 2.0

    @property
    def bag(self) -> Path:
        """Folder of the bag."""
        return self.folder / "bag"


def run_session(
    session: Session, domain: int, say: Callable[[str], None] = lambda text: None
) -> tuple[RunRecord, dict[str, Any]]:
    """Run and return the record and the guard's last words.

    Args:
        session: What to run.
        domain: ROS domain that nobody else uses.
        say: Told what is being waited for.

    Raises:
        SessionError: A process ended early or the arm was stopped.
        BagError: The bag is not whole.
    """
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    with Supervisor(_processes(session), session.folder / "log", environment) as supervisor:
        deadline = time.monotonic() + PATIENCE
        while "commander" not in supervisor.exit_codes():
            failure = supervisor.failed()
            if failure or time.monotonic() > deadline:
                raise SessionError(
                    failure or f"not finished after {PATIENCE:g} s; see {session.folder / 'log'}"
                )
            say("running")
            time.sleep(POLL_PERIOD)
        if supervisor.exit_codes()["commander"]:
            raise SessionError(supervisor.log("commander").read_text(encoding="utf8").strip().split("\n")[-1])
    return read_run(session.bag)


def _processes(session: Session) -> tuple[Process, ...]:
    graph = rig_graph(
        session.manipulator, session.preset, session.lockstep, str(session.bag), session.settings
    )
    if session.lockstep:
        waits = {"partners": ("estimator", "controller", "guard", "recorder")}
        graph = tuple(
            replace(row, parameters={**row.parameters, **waits}) if row.name == "rig" else row
            for row in graph
        )
    moves: dict[str, Any] = {"angles": session.angles, "out": session.out, "back": session.back}
    if session.reference:
        moves = {"reference": str(session.reference)}
    shared = {"manipulator": session.manipulator, "preset": session.preset, "lockstep": session.lockstep}
    partners = tuple(row.name for row in graph)
    parameters = {**shared, **moves, "partners": partners, "preparation": session.preparation}
    commander = Process("flexarm_bringup", "commander_node", "commander", parameters, essential=False)
    return (*graph, commander)
