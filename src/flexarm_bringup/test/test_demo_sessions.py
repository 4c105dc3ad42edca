"""Runs over DDS as rows of the comparison: what the recorder has lost is not judged."""

from __future__ import annotations

import argparse
import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.demo_run import command, nodes_runs
from flexarm_bringup.demo_run.sessions import outcomes_of
from flexarm_bringup.demo_run.timekeeping import Timekeeping, timekeeping
from flexarm_bringup.demo_run.unfinished import why_unfinished
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.processes.machine_speed import CLASS_US
from flexarm_bringup.processes.session import Session, SessionError
from flexarm_bringup.processes.speed_witness import SpeedWitness
from flexarm_bringup.processes.standstill import Standstill, Witnesses
from flexarm_bringup.progress import Progress
from flexarm_bringup.record import RunRecord

DT = 5e-3
WIDTHS = {"theta": 1, "tip": 6, "strain": 1, "relative": 1, "tau": 1, "eta": 3, "eta_sigma": 3}


def standing(seconds: float, without: int | None = None) -> RunRecord:
    """Return the record of an arm that does nothing, perhaps without one of its ticks."""
    count = round(seconds / DT)
    columns = {name: np.zeros((count, width)) for name, width in WIDTHS.items()}
    whole = RunRecord(t=DT * np.arange(count), fresh=np.ones(count, dtype=bool), **columns)
    kept = np.arange(count) != without
    return RunRecord(*(getattr(whole, field.name)[kept] for field in fields(RunRecord)))


def test_a_record_with_a_gap_in_a_move_is_refused_by_name() -> None:
    session = Session(Path("light_hub_real_time"), "light_hub", False, (10.0,), "A", "ZVD")
    end = outcomes_of(session, standing(30.0))[-1].move.watch_end
    assert len(outcomes_of(session, standing(end + 1.0))) == 2
    with pytest.raises(SessionError, match=r"light_hub_real_time: samples of a move are missing: .* equal"):
        outcomes_of(session, standing(end + 1.0, without=round((end - 1.0) / DT)))


def test_a_machine_that_cannot_keep_real_time_still_shows_what_lockstep_was_worth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was silent for 50 ms in every try; the demo ended without a page."""
    tried: list[Path] = []

    def run(session: Session, *_: object) -> tuple[RunRecord, dict[str, int]]:
        tried.append(session.folder)
        if not session.lockstep and session.preset == "geared":
            raise SessionError("guard stopped the arm: the drives have let go of this guard")
        return standing(60.0), {"ticks": 1, "ticks_without_command": 0, "told": []}

    monkeypatch.setattr(command, "run_session", run)
    monkeypatch.setattr(nodes_runs, "run_parallel", lambda do, todo, _: [x for job in todo for x in do(job)])
    args = argparse.Namespace(folder=tmp_path, no_realtime=False)
    sessions, failures = command._run_sessions(args, Progress())
    assert [(run.session.preset, run.session.lockstep) for run in sessions] == [
        ("geared", True), ("light_hub", True), ("light_hub", False),
    ]  # fmt: skip
    (failure,) = failures
    assert failure.name == "geared_real_time"
    assert "let go of this guard" in failure.found
    assert failure.found.endswith("the last of 3 tries")
    assert len(set(tried)) == len(tried) == 6


def test_a_picture_is_there_before_the_nodes_begin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a slow machine it came after eight minutes, with the last run; it needs none of them."""
    monkeypatch.setattr(command, "run_jobs", lambda *_: [])
    monkeypatch.setattr(command, "draw_tip", lambda study: Figure("tip", "<svg></svg>"))

    def sessions(*_: object) -> None:
        assert (tmp_path / "still_tip.svg").read_text().startswith("<svg")
        raise SessionError("the nodes")

    monkeypatch.setattr(command, "_run_sessions", sessions)
    args = argparse.Namespace(folder=tmp_path, name=None, no_dds=False, json=None, html=None)
    with pytest.raises(SessionError, match="the nodes"):
        command.run(args)


def test_the_machine_is_watched_by_the_clock_alone_and_also_where_the_run_breaks_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Witnesses have the steady clock, the guard stamps by the other."""

    def seen(self: Witnesses, *_: object) -> None:
        now = time.monotonic()
        self.standstills = [Standstill(now - 0.05, now)]

    def timed(self: SpeedWitness, *_: object) -> None:
        self.steps_us = [0.5 * CLASS_US, 2.0 * CLASS_US, 9.0 * CLASS_US]

    for witness, end in ((Witnesses, seen), (SpeedWitness, timed)):
        monkeypatch.setattr(witness, "__enter__", lambda self: self)
        monkeypatch.setattr(witness, "__exit__", end)
    with timekeeping(False) as lockstep:
        pass
    with pytest.raises(SessionError), timekeeping(True) as live:
        raise SessionError("stopped")
    assert not lockstep.seen and not lockstep.standstills
    assert (lockstep.slow, live.slow) == (1.0, 2.0)
    assert live.seen.endswith("1 times, for 50 ms at most")
    assert live.standstills[0].end == pytest.approx(time.time(), abs=10.0)
    assert why_unfinished(SessionError("stopped"), live) == f"stopped; {live.seen}"
    assert why_unfinished(SessionError("stopped"), lockstep) == "stopped"


@pytest.mark.parametrize(
    ("told", "excused"),
    [
        ([(10.0, 0), (10.1, 0), (10.2, 6), (10.3, 6)], True),  # all of them after the standstill
        ([(10.0, 0), (10.1, 0), (10.2, 6), (10.3, 6), (20.0, 16)], True),  # ten of the loop's own: 1 %
        ([(10.0, 0), (10.1, 0), (10.2, 6), (10.3, 6), (20.0, 17)], False),
        ([(10.0, 0), (10.1, 0), (10.2, 5), (10.3, 5)], False),  # half of the bound is left
        ([(10.0, 0), (10.1, 0), (10.3, 0), (10.4, 60)], False),  # another time
        ([], False),
    ],
)
def test_the_machine_is_excuse_for_what_it_cost_and_not_for_what_the_loop_lost(
    told: list[tuple[float, int]], excused: bool
) -> None:
    kept = Timekeeping("the machine stood still", [Standstill(10.12, 10.14)])
    kept.attribute({"ticks": 1000, "told": told})
    assert bool(kept.excuse) == excused
    assert not excused or kept.excuse.startswith(f"6 of {told[-1][1]} periods")


@pytest.mark.parametrize(("slow", "excused"), [(1.0, False), (1.49, False), (1.51, True), (4.0, True)])
def test_a_machine_much_slower_than_the_class_is_no_judge(slow: float, excused: bool) -> None:
    kept = Timekeeping(slow=slow)
    kept.attribute({"ticks": 1000, "told": [(10.0, 0), (20.0, 500)]})
    assert bool(kept.excuse) == excused == bool(kept.too_slow)
    assert not excused or f"{slow:.2f} times what it takes on machines of the class" in kept.excuse
