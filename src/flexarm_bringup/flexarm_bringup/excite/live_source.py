"""``flexarm identify rig --nodes``: the modal test over DDS, on a graph of its own or one that runs."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from flexarm_bringup.excite.bag import read_test
from flexarm_bringup.excite.measure import MeasuredTest
from flexarm_bringup.excite.options import JOIN, LOCKSTEP
from flexarm_bringup.excite.rig_source import RigTest
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.processes.graph import Process, rig_graph
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.processes.timing import timing

POLL_PERIOD = 0.1  # s
PARTNERS = ("model", "guard", "rig")
EXCITE, RECORDER = "excite", "recorder"


def run_live_test(test: RigTest, mode: str, folder: Path, say: Callable[[str], None]) -> MeasuredTest:
    """Run the excite node and a recorder, beside the graph that runs or with one of their own.

    Args:
        test: What to do.
        mode: One of ``options.MODES``: a graph by the clock, in lockstep, or the one that runs already.
        folder: Gets the bag and the log files.
        say: Is told what is being waited for.

    Raises:
        SourceError: A process ended early, the guard stopped the arm, or a channel cannot be used.
    """
    environment = dict(os.environ)
    if mode != JOIN:
        from flexarm_bringup.demo_run.sessions import free_domains

        environment |= {
            "ROS_DOMAIN_ID": str(next(free_domains())),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }
    with Supervisor(live_graph(test, mode, folder / "bag"), folder / "log", environment) as supervisor:
        while EXCITE not in supervisor.exit_codes():
            failure = supervisor.failed()
            if failure:
                raise SourceError(failure)
            say(_last_words(supervisor))
            time.sleep(POLL_PERIOD)
    if supervisor.exit_codes()[EXCITE] == 0:
        found = read_test(folder / "bag")
        if found is not None:
            return found
    else:
        _tell_refused_sensors(folder / "bag")
    raise SourceError(_last_words(supervisor))


def live_graph(test: RigTest, mode: str, bag: Path) -> tuple[Process, ...]:
    """Return the processes; nobody but the excite node commands.

    Args:
        test: What to do.
        mode: See ``run_live_test``.
        bag: Folder to record into.
    """
    is_lockstep = mode == LOCKSTEP
    settings: dict[str, Mapping[str, Any]] = {
        RECORDER: {"partners": PARTNERS},
        "guard": {"start": test.pose},
        "rig": {
            **asdict(test.simulation), "faults": test.faults, "start": test.pose,
            "partners": ("guard", RECORDER),
        },
    }  # fmt: skip
    graph = rig_graph(test.manipulator, test.preset, is_lockstep, str(bag.resolve()), settings)
    kept = (RECORDER,) if mode == JOIN else (RECORDER, *PARTNERS)
    rows = [replace(row, respawn=False) for row in graph if row.name in kept]
    shared = {"manipulator": test.manipulator, "preset": test.preset, "lockstep": is_lockstep}
    own = {
        **shared,
        **({} if is_lockstep else timing("controller")),
        **_wishes(test),
        "partners": (*PARTNERS, RECORDER),
    }
    return (*rows, Process("flexarm_bringup", "excite_node", EXCITE, own, essential=False, respawn=False))


def _wishes(test: RigTest) -> dict[str, Any]:
    """Return the parameters of the excite node that are not defaults."""
    wish = test.wish
    given = {
        "pose": test.pose, "band": wish.band_hz or (), "resolution": wish.resolution_hz or 0.0,
        "ignore": test.ignore,
    }  # fmt: skip
    some = {name: value for name, value in given.items() if value}
    return {"signal": wish.signal, "periods": wish.periods, "share": wish.share, **some}


def _tell_refused_sensors(bag: Path) -> None:
    """Raise with the findings of the sensor check if that is what ended the test."""
    if (bag / "metadata.yaml").is_file():
        read_test(bag)


def _last_words(supervisor: Supervisor) -> str:
    lines = supervisor.log(EXCITE).read_text(encoding="utf8", errors="replace").split("\n")
    line = next((line for line in reversed(lines) if line.strip()), "starting")
    return line.rpartition("]: ")[2]
