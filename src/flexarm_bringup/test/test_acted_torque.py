"""Torques too late for their period: the drive held the one before, as its own measurement says."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from flexarm_bringup.excite.acted_excitation import OLDEST, acted_excitation
from flexarm_bringup.excite.measure import MeasuredTest
from flexarm_bringup.excite.page import late_share
from flexarm_bringup.identify.acted_torque import acted

DT, N, SKIPPED = 0.005, 400, 100


def drive(late: np.ndarray, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return stamps, what was sent, what acted, and what a drive measures that holds what it has."""
    rng = np.random.default_rng(3)
    t, sent = 1.0e9 + DT * np.arange(N), rng.standard_normal(N)  # as large as stamps of today
    acting = sent.copy()
    for k in np.flatnonzero(late):
        acting[k] = acting[k - 1]
    return t, sent, acting, acting + noise * rng.standard_normal(N)


def some(share: float) -> np.ndarray:
    late = np.random.default_rng(4).random(N) < share
    late[0] = False
    return late


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3])
def test_what_acted_is_found_however_often_torques_were_late(share: float) -> None:
    t, sent, acting, measured = drive(some(share))
    found = acted((t, sent), (t, measured), DT)
    np.testing.assert_array_equal(found[0], t)
    np.testing.assert_array_equal(found[1], acting)


def test_the_noise_of_a_drives_measurement_stays_out() -> None:
    """Values are those sent; a decision is wrong only where both torques differ by less than the noise."""
    t, sent, acting, measured = drive(some(0.1), noise=0.02)
    found = acted((t, sent), (t, measured), DT)[1]
    assert np.isin(found, sent).all()
    assert np.std(found - acting) < 0.02 < 0.2 < np.std(sent - acting)


def test_a_drive_that_measures_nothing_or_not_always_is_believed_where_it_speaks() -> None:
    t, sent, acting, measured = drive(some(0.1))
    np.testing.assert_array_equal(acted((t, sent), (t[:0], t[:0]), DT)[1], sent)
    half = slice(N // 2, None)
    found = acted((t, sent), (t[half], measured[half]), DT)[1]
    np.testing.assert_array_equal(found[: N // 2], sent[: N // 2])
    np.testing.assert_array_equal(found[N // 2 + 5 :], acting[N // 2 + 5 :])


def test_a_message_that_the_bag_has_not_leaves_the_others_in_place() -> None:
    t, sent, acting, measured = drive(some(0.05))
    kept = np.arange(N) % 50 != 7
    found = acted((t[kept], sent[kept]), (t, measured), DT)
    np.testing.assert_array_equal(found[0], t[kept])
    assert np.mean(found[1] != acting[kept]) < 0.01


@pytest.mark.parametrize("share", [0.0, 0.2, 0.6])
def test_the_excitation_that_acted_is_that_of_the_command_that_acted(share: float) -> None:
    """Two axes; commands are late by up to three periods, and the torque held then names them."""
    rng = np.random.default_rng(5)
    added, feedback = rng.standard_normal((2, N, 2))
    commanded = added + feedback
    which = np.arange(N)
    for k in np.flatnonzero(rng.random(N) < share):
        which[k] = np.maximum(k - rng.integers(1, 4), 0)
    np.testing.assert_array_equal(acted_excitation(commanded[which], commanded, added), added[which])


def test_a_torque_that_the_guard_changed_keeps_the_excitation_of_its_own_command() -> None:
    rng = np.random.default_rng(6)
    added = rng.standard_normal((N, 1))
    acting = 2.0 * added
    acting[50] = 7.0
    acting[60 + OLDEST + 1] = 2.0 * added[60]  # older than any command that the guard uses
    np.testing.assert_array_equal(acted_excitation(acting, 2.0 * added, added), added)


@pytest.mark.parametrize("late", [0, 3, 60])
def test_the_page_tells_how_often_another_excitation_acted_than_was_asked(late: int) -> None:
    asked = np.random.default_rng(7).standard_normal((N, 2))
    acted_part = asked[SKIPPED:].copy()
    acted_part[:late, 1] += 0.1
    tested = SimpleNamespace(
        axes=("a", "b"),
        plan=SimpleNamespace(added=lambda run: asked),
        records=(SimpleNamespace(instruments=dict(zip("ab", acted_part.T, strict=True))),),
    )
    assert late_share(cast(MeasuredTest, tested)) == pytest.approx(late / (N - SKIPPED))
