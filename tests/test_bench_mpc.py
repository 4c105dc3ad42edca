"""The benchmark of the controller's step treats flexarm and the others alike."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.bench import load_module

bench_mpc = load_module(Path(__file__).resolve().parents[1] / "benchmarks" / "bench_mpc.py")
STEPS, FIRST = 300, 150  # and the first step in which limits bind
US = 1e-6


def test_every_single_run_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The shortest of three hid every late step of ours."""
    runs = 1 + bench_mpc.REPEATS
    clock = iter(np.cumsum([0, 5] * runs * 4) * 1000)
    monkeypatch.setattr(bench_mpc.time, "thread_time_ns", lambda: int(next(clock)))
    asked: list[int] = []
    times = bench_mpc.times_of(asked.append, range(4))
    assert asked == [*range(4)] * runs
    assert np.allclose(times, 5 * US) and times.shape == (runs, 4)


def test_ratios_are_of_the_same_steps_as_often(monkeypatch: pytest.MonkeyPatch) -> None:
    """do-mpc's twenty steps were held against other steps of ours, once against three times."""
    binding = np.arange(STEPS) >= FIRST
    spent = US * np.tile(np.arange(1.0, STEPS + 1.0), (bench_mpc.REPEATS, 1))  # of every step its number
    spent[0] *= 10.0  # one of the runs was late
    asked: dict[str, slice] = {}

    def sparse(_: Any, name: str, window: slice) -> tuple[float, Any]:
        asked[name] = window
        return 1e-6, 3.0 * spent[:, window]

    def do_mpc(_: Any, window: slice) -> Any:
        asked["do_mpc"] = window
        return 500.0 * spent[:, window]

    monkeypatch.setattr(bench_mpc, "time_ours", lambda _: (np.vstack([100.0 * spent[:1], spent]), binding, 0))
    monkeypatch.setattr(bench_mpc, "time_sparse", sparse)
    monkeypatch.setattr(bench_mpc, "time_do_mpc", do_mpc)
    monkeypatch.setattr(bench_mpc.importlib.util, "find_spec", lambda name: name)
    found = bench_mpc.measure(SimpleNamespace())
    assert found["do_mpc_to_mpc_median"] == pytest.approx(500.0)
    assert found["fastest_sparse_to_mpc_median"] == pytest.approx(3.0)
    assert found["fastest_sparse_to_mpc_p99"] == pytest.approx(3.0)
    assert found["mpc_p99_us"] == pytest.approx(np.percentile(spent, 99.0) / US)
    assert set(asked) == {"do_mpc", *bench_mpc.sparse_program.SPARSE_SOLVERS}
    assert all(window == slice(FIRST, FIRST + bench_mpc.OF_OTHERS) for window in asked.values())
