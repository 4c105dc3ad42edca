"""Make the golden case anew: record a lockstep run over DDS, keep its first second and what comes of it.

    ./flexarm shell, then: python tests/make_golden.py [RECORDED_BAG]

What the bag holds of estimator and controller is what the nodes said over DDS, so that a replay that agrees
with it proves both the libraries and the replay. Where only numbers moved and the recording is still right,
`./flexarm regress tests/golden --update` is enough. Either only in a commit that says why the numbers moved.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from flexarm_bringup.regress.making import Source, make_case

CASE = Path(__file__).parent / "golden" / "single_link"
ABOUT = "One second of 10 degrees on case A with MPC, recorded over DDS in lockstep (tests/make_golden.py)."
DURATION = 1.0  # s


def record(folder: Path) -> Path:
    """Run 10 degrees out and back with the installed nodes and return the bag."""
    import domain_coordinator

    from flexarm_bringup.processes.session import Session, run_session

    session = Session(folder, "geared", True, (10.0,), "A", "ZVD")
    with domain_coordinator.domain_id() as domain:
        run_session(session, domain)
    return session.bag


def main(recorded: Path | None = None, case: Path = CASE) -> dict[str, int]:
    """Record unless there is a recording, make the case; return what the bag has by topic."""
    with tempfile.TemporaryDirectory() as scratch:
        bag = recorded or record(Path(scratch))
        made = make_case(Path(scratch) / "case", Source(bag, ABOUT, until=DURATION, markers=("ros",)))
        shutil.rmtree(case, ignore_errors=True)
        shutil.copytree(made.folder, case)
    for name, count in made.bag.counts.items():
        print(f"{count:6d}  {name}")
    return dict(made.bag.counts)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
