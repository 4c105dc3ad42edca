"""What the nonlinear controller gains on large fast moves, and where it gains nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flexarm_bringup.bench import load_module

BENCHMARK = Path(__file__).resolve().parents[1] / "benchmarks" / "bench_nmpc_move.py"


@pytest.mark.slow
def test_an_arm_under_gravity_whose_pose_changes_keeps_to_its_path_and_is_still_at_once() -> None:
    ours, linear = _legs("variable_stiffness", 0.715)
    assert ours.residual.distance < 0.3 * min(leg.residual.distance for leg in linear)
    assert ours.residual.settling < 0.5 * min(leg.residual.settling for leg in linear)
    assert ours.tracking < 0.3 * min(leg.tracking for leg in linear)


@pytest.mark.slow
def test_two_links_settle_sooner_and_keep_closer_to_their_path() -> None:
    ours, linear = _legs("two_link", 0.4095)
    assert ours.residual.settling < 0.8 * min(leg.residual.settling for leg in linear)
    assert ours.tracking < min(leg.tracking for leg in linear)


def _legs(name: str, duration: float) -> tuple[Any, list[Any]]:
    """Return what the nonlinear law leaves, and what the four linear rows leave."""
    benchmark = load_module(BENCHMARK)
    legs = benchmark.run_arm(benchmark.ARMS[name], duration)
    return legs["nmpc_extended"], [leg for row, leg in legs.items() if not row.startswith("nmpc")]


@pytest.mark.slow
def test_a_single_link_in_the_plane_gains_nothing() -> None:
    benchmark = load_module(BENCHMARK)
    legs = benchmark.run_arm(benchmark.ARMS["single_link"], 0.3575)
    for kind in benchmark.FILTERS:
        linear, ours = legs[f"mpc_{kind}"].residual, legs[f"nmpc_{kind}"].residual
        assert ours.distance == pytest.approx(linear.distance, rel=0.02)
        assert ours.acceleration == pytest.approx(linear.acceleration, rel=0.02)
