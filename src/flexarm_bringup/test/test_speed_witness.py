"""The machine is timed beside what runs, not before and after it."""

from __future__ import annotations

import os
import time

import pytest

from flexarm_bringup.processes import speed_witness
from flexarm_bringup.processes.speed_witness import SpeedWitness


def test_it_times_the_machine_while_something_runs_and_ends_with_it() -> None:
    with SpeedWitness() as witness:
        end = time.monotonic() + 60.0
        while os.fstat(witness._file.fileno()).st_size == 0 and time.monotonic() < end:
            time.sleep(0.05)
    assert witness.steps_us
    assert all(1.0 < step < 1e5 for step in witness.steps_us)
    assert witness._child.poll() is not None


def test_who_was_started_by_nobody_any_more_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    timed: list[int] = []
    monkeypatch.setattr(speed_witness, "filterpy_step_us", lambda steps: timed.append(steps) or 27.0)
    monkeypatch.setattr(speed_witness, "PERIOD", 0.0)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    monkeypatch.setattr("os.nice", lambda _: 0)
    parents = iter([7, 7, 1])
    monkeypatch.setattr("os.getppid", lambda: next(parents))
    assert speed_witness.watch(7) == 0
    assert timed == [speed_witness.STEPS] * 2
