"""The benchmark of the identification on a small record: every mode that was put in is found."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexarm_bringup.bench import load_module

BENCH = Path(__file__).parents[3] / "benchmarks" / "bench_identify.py"


@pytest.mark.slow
def test_sixty_seconds_of_eight_channels_become_all_modes_within_the_time() -> None:
    result = load_module(BENCH).main()
    print(result)
    assert result["modes_found"] == result["modes_put_in"] and result["modes_invented"] == 0
    assert result["identify_60_s_of_8_channels_s"] < 10.0  # CPU time; typically under 1 s
