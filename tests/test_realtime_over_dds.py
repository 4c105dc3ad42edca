"""Rig, estimator and controller by the clock: counted the same by all, alone and two in one process.

Whether the bounds of real time are kept depends on the machine; ``./flexarm realtime`` says.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import pytest

from flexarm_bringup.realtime.command import add_arguments, measure
from flexarm_bringup.realtime.figures import Figures
from flexarm_controller.answer import MOST_RATE

pytestmark = [pytest.mark.ros, pytest.mark.slow]

TRIES = 4  # a loaded machine may fall silent for long enough to be stopped


def watch(folder: Path, *options: str) -> Figures:
    """Watch for some seconds, again where the machine was too busy."""
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    for attempt in range(TRIES):
        own = folder / str(attempt)
        own.mkdir()
        figures = measure(parser.parse_args(["--minutes", "0.1", *options]), own)
        if not figures.stop:
            return figures
    pytest.fail(f"stopped in {TRIES} tries: {figures.stop}")


@pytest.mark.parametrize(
    ("options", "rate"),
    [(("--load",), 200.0), (("--composed",), 200.0), (("--composed", "--rate", "500"), 500.0)],
    ids=["one core busy", "composed", "composed at 500 Hz"],
)
def test_every_guard_cycle_is_answered_or_told_as_missed(
    tmp_path: Path, options: tuple[str, ...], rate: float
) -> None:
    figures = watch(tmp_path, *options)
    counts = figures.counts
    assert counts.ticks == pytest.approx(
        rate * figures.seconds, rel=0.1
    )  # the status comes ten times a second
    assert counts.answers + counts.missed == pytest.approx(counts.ticks, rel=0.1)
    told = counts.answers / math.ceil(rate / MOST_RATE)
    assert set(figures.modes) >= {"mpc"} and sum(figures.modes.values()) == pytest.approx(told, rel=0.2)
    assert 0 <= counts.overruns <= counts.answers
