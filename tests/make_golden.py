"""Make the golden bag: record a lockstep run over DDS, keep its first second.

    ./flexarm shell, then: python tests/make_golden.py tests/golden/single_link [RECORDED_BAG]

What it holds of estimator and controller is what the nodes said over DDS, so that a replay that agrees
with it proves both the libraries and the replay. Make a new one only in a commit that says why the
numbers moved, and pin the SHA-256 and counts that this prints in tests/test_replay.py.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from flexarm_bringup.bag_reader import Bag, check_bag
from flexarm_bringup.bag_writer import CHECKSUM_FILE, BagWriter
from flexarm_bringup.tick_check import check_ticks
from flexarm_bringup.topics import find_stream

DURATION_NS = 1_000_000_000
LEFT_OUT = ("/diagnostics",)  # times of the wall clock


def cut(bag: Bag, folder: Path, duration_ns: int = DURATION_NS) -> Bag:
    """Write what happened before ``duration_ns`` into a new bag and return it."""
    kept = [r for r in bag.records if r.log_time_ns < duration_ns and r.name not in LEFT_OUT]
    found = {record.name for record in kept}
    streams = [stream for name in bag.counts if name in found and (stream := find_stream(name))]
    with BagWriter(folder, streams, bag.custom) as writer:
        for record in kept:
            writer.write(record.name, record.log_time_ns, record.cdr)
    return check_bag(folder)


def record(folder: Path) -> Path:
    """Run 10 degrees out and back with the installed nodes and return the bag."""
    import domain_coordinator

    from flexarm_bringup.session import Session, run_session

    session = Session(folder, "geared", True, (10.0,), "A", "ZVD")
    with domain_coordinator.domain_id() as domain:
        run_session(session, domain)
    return session.bag


def main(folder: Path, recorded: Path | None = None) -> dict[str, int]:
    """Record unless there is a recording, cut, check, print what to pin; return the counts."""
    with tempfile.TemporaryDirectory() as scratch:
        golden = cut(check_bag(recorded or record(Path(scratch))), folder)
    print(f"{check_ticks(golden)} ticks; {(folder / CHECKSUM_FILE).read_text().split()[0]}")
    for name, count in golden.counts.items():
        print(f"{count:6d}  {name}")
    return dict(golden.counts)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
