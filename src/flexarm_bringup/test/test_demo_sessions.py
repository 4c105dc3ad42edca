"""Runs over DDS as rows of the comparison: what the recorder has lost is not judged."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.demo_run.sessions import outcomes_of
from flexarm_bringup.processes.session import Session, SessionError
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
