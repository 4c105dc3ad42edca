"""The test stand over DDS: rig, model, estimator, controller, guard as nodes in lockstep, read from the bag.

The rig node injects the faults; joint PD on the estimate follows the same tour as in one process.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from flexarm_bringup.bags.bag_reader import check_bag, decode, stamp_of
from flexarm_bringup.demo_run.task_session import task_settings
from flexarm_bringup.fault_drill.motion_record import DURATION
from flexarm_bringup.fault_drill.stand import Faults, Stand, Trace, trace_of
from flexarm_bringup.fault_drill.told_estimate import told_estimate
from flexarm_bringup.processes.session import Session, SessionError, run_session
from flexarm_bringup.sim.sensor_fault_text import faults_text
from flexarm_bringup.sim_run.study import SimJob
from flexarm_bringup.tasks.reference_file import from_rest, save_reference
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.manipulator.sensor_spec import SensorSpec

TOPICS = ("truth", "modal_state", "end_effector")
LEFT = "stopped by topic stop"  # of an arm with weight whose state is lost: what came until then is judged
PREPARATION = 5.0  # s in real time; models of the whole tour are made before it starts


class NodesStand:
    """One machine as nodes; the same rows can be played on it."""

    def __init__(self, stand: Stand, folder: Path, domains: Iterator[int]) -> None:
        """Use the tour of a stand.

        Args:
            stand: The machine.
            folder: Gets bags and logs.
            domains: ROS domains that nobody else uses.
        """
        self._stand, self._folder, self._domains = stand, folder, domains
        self._runs = count()

    @property
    def name(self) -> str:
        """Name of the manipulator."""
        return self._stand.name

    @property
    def dt(self) -> float:
        """Control period [s]."""
        return self._stand.dt

    @property
    def sensors(self) -> tuple[SensorSpec, ...]:
        """Sensors of the machine."""
        return self._stand.sensors

    @property
    def library(self) -> Trace:
        """The run without any fault in one process."""
        return self._stand.nominal

    @cached_property
    def nominal(self) -> Trace:
        """The run without any fault."""
        return self.play({})

    def of_kind(self, *kinds: str) -> tuple[SensorSpec, ...]:
        """Return the sensors of some kinds."""
        return self._stand.of_kind(*kinds)

    def play(self, faults: Faults) -> Trace:
        """Run the nodes with faults, by sensor.

        Raises:
            SessionError, BagError: The run did not come to its end.
        """
        folder = self._folder / str(next(self._runs))
        folder.mkdir(parents=True)
        arm, reference = self._stand.arm, folder / "reference.npz"
        save_reference(reference, from_rest(arm.course.reference), DURATION)
        job = SimJob(arm.task, arm.task.presets[0], "", arm.course)
        settings = task_settings(job, "pd")
        settings["rig"] |= {"faults": faults_text(faults, self.sensors), "seed": self._stand.seed}
        session = Session(
            folder,
            job.preset,
            True,
            (),
            "",
            "",
            settings,
            self._stand.arm.task.manipulator,
            reference,
            PREPARATION,
        )
        try:
            run_session(session, next(self._domains))
        except SessionError as error:
            trace = _read(session.bag, self._stand.touched(faults)) if LEFT in str(error) else None
            if trace is None or trace.estimates[-1].status != "lost":
                raise
            return trace
        return _read(session.bag, self._stand.touched(faults))


def _read(bag: Path, touched: dict[str, int]) -> Trace:
    names = {f"{NAMESPACE}/{topic}": topic for topic in TOPICS}
    told: dict[str, dict[int, Any]] = {topic: {} for topic in TOPICS}
    for record in check_bag(bag, tuple(names)).records:
        if record.name in names:
            msg = decode(record)
            told[names[record.name]][stamp_of(msg)] = msg
    stamps = sorted(set.intersection(*(set(messages) for messages in told.values())))
    t = np.array(stamps) * 1e-9
    tip = np.array([told["truth"][stamp].tip[:3] for stamp in stamps])
    pairs = [(told["modal_state"][stamp], told["end_effector"][stamp]) for stamp in stamps]
    estimates = [told_estimate(*pair, float(now)) for pair, now in zip(pairs, t, strict=True)]
    return trace_of(t, tip, estimates, touched)
