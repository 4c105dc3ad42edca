"""Runs over DDS as rows of the comparison."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any

from domain_coordinator import domain_id  # picks a domain nobody on this machine uses

from flexarm_bringup.demo_run.motions import motions, out_and_back
from flexarm_bringup.demo_run.study import Job, Outcome, damping_ratio, outcome_of, tip_reach
from flexarm_bringup.demo_run.timekeeping import Timekeeping
from flexarm_bringup.processes.session import Session, SessionError
from flexarm_bringup.record import RunRecord
from flexarm_bringup.residual import GapError
from flexarm_model.process.security import check_unsecured
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

_taken: list[AbstractContextManager[int]] = []  # a domain is free again when its entry goes


@dataclass(frozen=True)
class SessionRun:
    """A finished run over DDS.

    Attributes:
        session: What was asked.
        guard: The guard's last words.
        outcomes: Its moves.
        broken_off: Why runs before it came to no end.
        kept: How the machine kept time.
    """

    session: Session
    guard: dict[str, Any]
    outcomes: tuple[Outcome, ...]
    broken_off: tuple[str, ...] = ()
    kept: Timekeeping = field(default_factory=Timekeeping)

    @property
    def share_without_command(self) -> float:
        """Share of motor periods without a fresh command [1]."""
        return float(self.guard["ticks_without_command"] / max(self.guard["ticks"], 1))


def outcomes_of(session: Session, record: RunRecord) -> tuple[Outcome, ...]:
    """Judge the moves of a run.

    Raises:
        SessionError: The recorder has lost samples of a move.
    """
    config = load_config(find_manipulator(session.manipulator), session.preset)
    makers = motions(damping_ratio(config))
    moves = out_and_back([math.radians(angle) for angle in session.angles], session.out, session.back, makers)
    where = "DDS lockstep" if session.lockstep else "DDS real time"
    job = Job(session.preset, "mpc", session.angles, 0.0, session.manipulator)
    try:
        return tuple(outcome_of(job, move, record, where, tip_reach(config)) for move in moves)
    except GapError as error:
        raise SessionError(f"{session.folder}: samples of a move are missing: {error}") from error


def free_domains() -> Iterator[int]:
    """Yield ROS domains that no other test or demo on this machine has taken.

    They stay taken as long as this process lives: who took one may run nodes in it when the iterator is gone.

    Raises:
        SecurityError: Security is asked for: for such a domain there are no keys.
    """
    check_unsecured()
    while True:
        _taken.append(domain_id())
        yield int(_taken[-1].__enter__())
