"""Whatever code with a fault raises is a divergence of its case, told by name; the next case is judged."""

from __future__ import annotations

import errno
import json
import shutil
from pathlib import Path
from typing import Any

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_writer import BagWriter  # noqa: E402
from flexarm_estimator.exchange import EstimatorExchange  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link"
RAISED: list[BaseException] = [
    AssertionError("boom"),
    MemoryError("boom"),
    NotImplementedError("boom"),
    OSError("boom"),
    RecursionError("boom"),
    RuntimeError("boom"),
    StopIteration(),
    TypeError("boom"),
    SystemExit(0),
]
FAULT_NS = 500_000_000


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    """Return a folder with two cases."""
    for name in ("first", "second"):
        shutil.copytree(GOLDEN, tmp_path / "cases" / name)
    return tmp_path / "cases"


@pytest.mark.parametrize(
    "error",
    [
        pytest.param(e, id=type(e).__name__, marks=[] if isinstance(e, SystemExit) else pytest.mark.slow)
        for e in RAISED
    ],
)
def test_what_is_raised_diverges_and_the_next_case_is_judged(
    error: BaseException, cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step, report, raised = EstimatorExchange.step, tmp_path / "report.json", []

    def faulty(self: EstimatorExchange, stamp_ns: int) -> Any:
        if stamp_ns > FAULT_NS and not raised:  # in the first case only
            raised.append(error)
            raise error
        return step(self, stamp_ns)

    monkeypatch.setattr(EstimatorExchange, "step", faulty)
    assert cli.main(["regress", str(cases), "--json", str(report)]) == 1
    first, second = json.loads(report.read_text())["cases"]
    assert (first["code"], second["code"]) == (1, 0)
    assert first["first"]["topic"] == "/flexarm/modal_state"
    assert type(error).__name__ in first["reason"] and str(error) in first["reason"]


def test_a_full_disk_is_no_fault_of_the_code(
    cases: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*args: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(BagWriter, "write", full)
    assert cli.main(["regress", str(cases / "first")]) == 2
    assert "No space left on device" in capsys.readouterr().err
