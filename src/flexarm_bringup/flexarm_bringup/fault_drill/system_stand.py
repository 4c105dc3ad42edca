"""The stand for rows with nodes: the machine as processes in ROS domains that nobody else uses."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cached_property, partial
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from flexarm_bringup.demo_run.task_session import task_settings
from flexarm_bringup.fault_drill.stand import Stand
from flexarm_bringup.processes.graph import Process, rig_graph
from flexarm_bringup.sim_run.study import SimJob

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_stand_node import LiveStand
    from flexarm_bringup.fault_drill.nodes_stand import NodesStand
    from flexarm_bringup.processes.running_graph_node import Ear

PATIENCE = 30.0  # s for something that takes a second
ATTEMPTS = 5  # to arm: where the machine stands still for 50 ms the guard stops again


class SystemStand:
    """One machine; what its rows start runs in folders of its own, which go when the stand goes."""

    def __init__(self, stand: Stand, folder: Path | None = None) -> None:
        """Use the tour of ``stand``; logs and bags go to ``folder`` (None: a temporary one)."""
        self.stand = stand
        self._temporary = None if folder else TemporaryDirectory(prefix="flexarm_faults_")
        self._root = folder or Path(self._temporary.name if self._temporary else "")
        self._runs = count()

    @property
    def name(self) -> str:
        """Name of the manipulator."""
        return self.stand.name

    @property
    def dt(self) -> float:
        """Control period [s]."""
        return self.stand.dt

    def folder(self) -> Path:
        """Return a new empty folder."""
        folder = self._root / str(next(self._runs))
        folder.mkdir(parents=True)
        return folder

    @cached_property
    def nodes(self) -> NodesStand:
        """Rig, model, estimator, controller and guard as nodes in lockstep."""
        from flexarm_bringup.demo_run.sessions import free_domains
        from flexarm_bringup.fault_drill.nodes_stand import NodesStand

        return NodesStand(self.stand, self.folder(), free_domains())

    def live(self) -> LiveStand:
        """Return a stand whose estimator is a node; use it with ``with``."""
        from flexarm_bringup.fault_drill.live_stand_node import LiveStand

        return LiveStand(self.stand, self.folder())

    def graph(self) -> tuple[Process, ...]:
        """Return the processes of the machine by the clock, without a recorder."""
        job = SimJob(self.stand.arm.task, self.stand.arm.task.presets[0], "", self.stand.arm.course)
        return rig_graph(job.task.manipulator, job.preset, settings=task_settings(job, "mpc"))

    def arm(self, ear: Ear) -> None:
        """Arm the guard, again where it has stopped at once, and wait until commands pass.

        Raises:
            WaitedTooLong: It does not come to that; says why the guard stopped last.
        """
        from flexarm_bringup.processes.running_graph_node import WaitedTooLong

        told, said = ear.heard["guard_status"], ""
        for _ in range(ATTEMPTS):
            ear.wait(lambda: bool(ear.call("guard/arm").success), PATIENCE, f"the guard to be armed{said}")
            told.clear()
            ear.wait(partial(is_decided, told, time.time()), PATIENCE, f"commands to pass{said}")
            if any(map(passes, told)):
                return
            said = f" after '{told[-1].reason}'"
        raise WaitedTooLong(f"armed {ATTEMPTS} times, and no command passed{said}")


def is_decided(told: Sequence[Any], armed: float) -> bool:
    """Return whether commands pass, or the guard has stopped again since it was ``armed`` [s]."""
    stopped = told and told[-1].mode == told[-1].STOPPED and stamp(told[-1]) > armed
    return any(map(passes, told)) or bool(stopped)


def passes(status: Any) -> bool:
    """Return whether a guard_status tells that commands pass."""
    return bool(status.mode == status.ARMED and status.command_age >= 0.0)


def stamp(msg: Any) -> float:
    """Return the stamp of a message [s]."""
    return float(msg.header.stamp.sec + 1e-9 * msg.header.stamp.nanosec)
