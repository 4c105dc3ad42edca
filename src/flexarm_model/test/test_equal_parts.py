"""What no mode tells apart is fitted as one, and the order of modes that are alike decides nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from arms import SINGLE_LINK
from numpy.typing import NDArray

from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.identification.described_modes import described_modes, read_unknown
from flexarm_model.identification.equal_parts import merged
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.model_update import update_model
from flexarm_model.identification.unknown import Unknown, changed
from flexarm_model.reading.config import load_config

Array = NDArray[np.float64]
Changes = Mapping[str, str | float]
PLANAR_3RRR = SINGLE_LINK.with_name("planar_3rrr.yaml")
LEFT, RIGHT = Unknown("legs.left.k", 100.0, "N/m", 0.3), Unknown("legs.right.k", 100.0, "N/m", 0.3)
LEFT_LOSS, RIGHT_LOSS = Unknown("legs.left.loss", 0.02, "", 1.0), Unknown("legs.right.loss", 0.02, "", 1.0)


def two_legs(changes: Changes, pose: Array) -> tuple[Array, ...]:
    """Return the modes of two springs on one bar of unit mass: equal legs make a pair of one frequency."""
    k = np.array([float(str(changes.get(f"legs.{leg}.k", 100.0)).split()[0]) for leg in ("left", "right")])
    loss = np.array([float(changes.get(f"legs.{leg}.loss", 0.02)) for leg in ("left", "right")])
    lean = pose[0]  # of the bar's mass to one leg
    order = np.argsort(f := np.sqrt(k * np.array([1.0 + lean, 1.0 - lean])) / (2 * np.pi))
    return f[order], loss[order] / 2


def table(changes: Changes, lean: float = 0.0, noise: float = 1e-4) -> ModeTable:
    f_hz, zeta = two_legs(changes, np.array([lean]))
    return ModeTable(np.array([lean]), f_hz, noise * f_hz, zeta, 0.01 * zeta)


def test_equal_legs_are_one_unknown_at_a_pose_that_does_not_tell_them_apart() -> None:
    (one,) = merged(two_legs, [LEFT, RIGHT], [table({})])
    assert one.paths == ("legs.left.k", "legs.right.k")
    assert one.name == "legs.left,right.k"
    assert changed([one], np.log([1.5])) == {"legs.left.k": "150 N/m", "legs.right.k": "150 N/m"}


def test_at_a_pose_that_tells_them_apart_they_are_two() -> None:
    assert merged(two_legs, [LEFT, RIGHT], [table({}, lean=0.2)]) == (LEFT, RIGHT)
    update = update_model(two_legs, [LEFT, RIGHT], [table({"legs.left.k": 90.0}, lean=0.2)])
    assert np.exp(update.x) == pytest.approx([0.9, 1.0], rel=1e-3)


def test_other_numbers_are_not_equal_parts_whatever_they_move() -> None:
    other = Unknown("legs.right.k", 101.0, "N/m", 0.3)
    gear = Unknown("gears.right.k", 100.0, "N/m", 0.3)
    longer = replace(RIGHT, part="another leg")
    assert merged(two_legs, [LEFT, other, gear, longer], [table({})]) == (LEFT, other, gear, longer)


def test_what_is_told_apart_only_by_a_change_as_large_as_expected_is_two() -> None:
    """Two links of 1 and 3 % of damping, both 1 % as described, came back as 1.5 %: a tenth told nothing."""
    f_hz = np.array([1.0, 3.0])
    found = ModeTable(np.zeros(1), f_hz, 1e-4 * f_hz, np.array([0.010, 0.030]), np.array([0.001, 0.003]))

    def serve(changes: Changes, pose: Array) -> tuple[Array, ...]:
        """Return two modes, each of which is damped mostly by one link."""
        upper, forearm = (float(changes.get(f"bodies.{name}.zeta", 0.01)) for name in ("upper", "forearm"))
        return f_hz, np.array([0.7 * upper + 0.3 * forearm, 0.3 * upper + 0.7 * forearm])

    links = [Unknown(f"bodies.{name}.zeta", 0.01, "", 1.0) for name in ("upper", "forearm")]
    assert merged(serve, links, [found]) == tuple(links)


def test_a_softer_leg_is_not_blamed_on_one_of_two() -> None:
    """The fit said of either leg, whichever it began to move, that it was 10 % softer, and was sure of it."""
    update = update_model(two_legs, [LEFT, RIGHT], [table({"legs.right.k": 90.0})])
    assert set(update.changes) == {"legs.left.k", "legs.right.k"}
    assert len(set(update.changes.values())) == 1
    assert np.exp(update.x[0]) == pytest.approx(np.sqrt(0.9), rel=2e-3)


def test_damping_of_a_pair_is_compared_as_a_mean() -> None:
    """Which of two modes of one frequency has which damping depends on their order, which is noise's."""
    found = table({"legs.left.loss": 0.01, "legs.right.loss": 0.04})
    turned = ModeTable(found.pose, found.f_hz, found.f_std_hz, found.zeta[::-1], found.zeta_std[::-1])
    fits = [update_model(two_legs, [LEFT_LOSS, RIGHT_LOSS], [each]) for each in (found, turned)]
    assert fits[0].x == pytest.approx(fits[1].x, abs=1e-12)
    for update in fits:
        (unknown,) = update.unknowns
        assert unknown.paths == ("legs.left.loss", "legs.right.loss")
        assert 0.02 * np.exp(update.x[0]) == pytest.approx(0.025, rel=1e-3)


def test_modes_that_only_the_model_has_as_one_are_compared_as_a_mean_too() -> None:
    """Of legs measured 2 % apart the model knows one frequency, and turns its shapes as it likes."""
    f_hz, zeta = np.array([1.59, 1.63]), np.array([0.01, 0.02])
    modes = ModeTable(np.zeros(1), f_hz, 1e-4 * f_hz, zeta, 0.01 * zeta)
    (one,) = merged(two_legs, [LEFT_LOSS, RIGHT_LOSS], [modes])
    assert one.paths == ("legs.left.loss", "legs.right.loss")


@pytest.mark.slow
def test_legs_of_a_3rrr_whose_strips_differ_come_back_as_their_mean() -> None:
    """Twelve unknowns answered with 0.2 % of uncertainty what was 3 % off, in another leg."""
    home = load_config(PLANAR_3RRR).home
    names = [
        f"bodies.{strip}_{leg}.pieces.1.youngs_modulus" for strip in ("first", "second") for leg in (1, 2, 3)
    ]
    unknowns = [read_unknown(PLANAR_3RRR, "", name, 0.3) for name in names]
    x = np.random.default_rng(0).normal(0.0, 0.05, len(unknowns))
    serve = described_modes(PLANAR_3RRR, "", False, DescribedArm(PLANAR_3RRR, "", False))
    f_hz, zeta = serve(changed(unknowns, x), home)
    unknown = np.full(6, np.nan)
    update = update_model(serve, unknowns, [ModeTable(home, f_hz[:6], 3e-4 * f_hz[:6], unknown, unknown)])
    assert [one.name for one in update.unknowns] == [
        "bodies.first_1,first_2,first_3.pieces.1.youngs_modulus",
        "bodies.second_1,second_2,second_3.pieces.1.youngs_modulus",
    ]
    assert update.is_settled
    assert update.x == pytest.approx(x.reshape(2, 3).mean(axis=1), abs=0.01)
