"""Make a golden case anew: record a lockstep run over DDS, keep its beginning and what comes of it.

    ./flexarm shell, then: python tests/make_golden.py [single_link | planar_3rrr [RECORDED_BAG]]

What the bag holds of estimator and controller is what the nodes said over DDS, so that a replay that agrees
with it proves both the libraries and the replay. Where only numbers moved and the recording is still right,
`./flexarm regress tests/golden --update` is enough. Either only in a commit that says why the numbers moved.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from flexarm_bringup.regress.making import Source, make_case

GOLDEN = Path(__file__).parent / "golden"


@dataclass(frozen=True)
class Recording:
    """What a case is recorded from.

    Attributes:
        about: What happens, in a sentence.
        duration: Of what is kept [s].
        record: Runs it with the installed nodes in a folder and a ROS domain and returns the bag.
    """

    about: str
    duration: float
    record: Callable[[Path, int], Path]


def out_and_back(folder: Path, domain: int) -> Path:
    """Run the single link 10 degrees out and back."""
    from flexarm_bringup.processes.session import Session, run_session

    session = Session(folder, "geared", True, (10.0,), "A", "ZVD")
    run_session(session, domain)
    return session.bag


def moves_of_the_task(folder: Path, domain: int) -> Path:
    """Run the 3RRR's moves of config/moves."""
    from flexarm_bringup.demo_run.task_session import run_task_session
    from flexarm_bringup.sim_run.conditions import NOMINAL
    from flexarm_bringup.sim_run.study import run_sim_job, sim_jobs
    from flexarm_bringup.tasks.task_for import task_for

    task = task_for("planar_3rrr")
    (job,) = sim_jobs(task, task.presets[:1], [NOMINAL])
    twin = next(result for result in run_sim_job(job) if result.law == "mpc")
    return run_task_session(job, twin, True, folder / "run", domain, lambda said: None).session.bag


RECORDINGS = {
    "single_link": Recording(
        "One second of 10 degrees on case A with MPC, recorded over DDS in lockstep (tests/make_golden.py).",
        1.0,
        out_and_back,
    ),
    "planar_3rrr": Recording(
        "The 3RRR on its way from pose A to B with MPC: loops, a learned stiffness, seven models adopted on "
        "the way, frames 30 ms late; recorded over DDS in lockstep (tests/make_golden.py planar_3rrr).",
        0.8,
        moves_of_the_task,
    ),
}


def main(name: str = "single_link", recorded: str = "") -> dict[str, int]:
    """Record unless there is a recording, make the case; return what the bag has by topic."""
    import domain_coordinator

    recording, case = RECORDINGS[name], GOLDEN / name
    with tempfile.TemporaryDirectory() as scratch, domain_coordinator.domain_id() as domain:
        bag = Path(recorded) if recorded else recording.record(Path(scratch), domain)
        source = Source(bag, recording.about, until=recording.duration, markers=("ros",))
        made = make_case(Path(scratch) / "case", source)
        shutil.rmtree(case, ignore_errors=True)
        shutil.copytree(made.folder, case)
    for topic, count in made.bag.counts.items():
        print(f"{count:6d}  {topic}")
    return dict(made.bag.counts)


if __name__ == "__main__":
    main(*sys.argv[1:])
