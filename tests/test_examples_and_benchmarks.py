"""Every example and benchmark runs, on a small size, and says something true."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from flexarm_bringup.bench import load_module

ROOT = Path(__file__).resolve().parents[1]
SMALL: dict[str, dict[str, Any]] = {
    "bench_estimator": {"seconds": 2.0},
    "bench_model": {"seconds": 0.2, "repeats": 20},
    "bench_memory": {"seconds": 8.0},
    "bench_serve": {"repeats": 5, "use_compiler": False},
    "bench_mpc": {"cases": ["8_states", "26_states"], "seconds": 0.3},
    "bench_solvers": {"machines": ["single_link", "serial_6r"], "seconds": 0.3},
    "bench_nmpc": {"steps": 200, "every": 60, "repeats": 2},
    "bench_nmpc_move": {"arms": 1},
    "bench_import": {"refinement": 0.4, "modes": 40, "seconds": 0.2},
}


def test_the_shortest_way_through_the_library_damps_the_arm() -> None:
    found = load_module(ROOT / "examples" / "still_tip.py").main()
    assert found["first_frequency_hz"] == pytest.approx(5.23, abs=0.005)
    assert found["residual_m_s2"] < 0.1  # 1.94 without control


def test_the_contracts_of_the_readme_called_by_hand_turn_the_arm_and_agree_on_its_frequency() -> None:
    found = load_module(ROOT / "examples" / "loop_by_hand.py").main()
    frequencies = [found[name] for name in ("strip_hz", "model_hz", "segments_hz")]
    assert frequencies == pytest.approx([5.23] * 3, abs=0.005)  # as printed, to its last digit
    assert found["free_hz"] > found["model_hz"]  # the hub moves against the strip
    assert abs(found["axis_off_deg"]) < 0.02 and abs(found["tip_off_mm"]) < 0.1
    assert not found["stopped"]


def test_a_smoother_goal_takes_longer_and_less_torque() -> None:
    found = load_module(ROOT / "examples" / "smooth_goals.py").main((0.25, 1.0), (10.0,))
    for preset in ("geared", "light_hub"):
        (hard, strong), (smooth, weak) = (found[f"{preset} 10 {ramp:g}"] for ramp in (0.25, 1.0))
        assert 0.1 < hard < smooth < 0.7 and 0.05 < weak < 0.9 * strong


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((ROOT / "benchmarks").glob("bench_*.py")), ids=lambda path: path.stem)
def test_every_benchmark_returns_finite_positive_numbers(path: Path) -> None:
    found = load_module(path).main(**SMALL.get(path.stem, {}))
    assert found
    assert all(math.isfinite(value) and value >= 0 for value in found.values()), found
