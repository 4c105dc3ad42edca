"""Planted changes are named by the regression, each where it shows first; unchanged code passes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")

from planted_changes import PLANTED, with_bad_samples  # noqa: E402

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_bringup.regress.making import Source, make_case  # noqa: E402
from flexarm_bringup.replaying import compare  # noqa: E402
from flexarm_bringup.replaying.compare import IGNORED, Tolerance  # noqa: E402
from flexarm_bringup.topics import NAMESPACE  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link" / "bag"
QUICK = ("sign of an output row", "camera stamped 1 ms late", "a NaN that passes")


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a case with something for every guard."""
    folder = tmp_path_factory.mktemp("planted")
    bag = with_bad_samples(check_bag(GOLDEN), folder / "recorded")
    return make_case(folder / "cases" / "bad_samples", Source(bag.path)).folder


def test_unchanged_code_passes(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["regress", str(case.parent)]) == 0
    assert "1 of 1 cases pass" in capsys.readouterr().out


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow]) for name in PLANTED]
)
def test_a_planted_change_is_named(
    name: str, case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planted = PLANTED[name]
    planted.plant(monkeypatch)
    report = tmp_path / "report.json"
    assert cli.main(["regress", str(case), "--json", str(report)]) == 1
    (found,) = json.loads(report.read_text())["cases"]
    assert found["first"]["topic"] == f"{NAMESPACE}/{planted.topic}"
    assert found["first"]["field"].startswith(planted.field)
    assert found["reason"] in capsys.readouterr().out
    assert found["first"]["text"].endswith((" expected", " missing"))


@pytest.mark.slow
def test_looser_defaults_hide_nothing(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compare, "TOLERANCES", (Tolerance("*", IGNORED, 0.0),))
    PLANTED["camera stamped 1 ms late"].plant(monkeypatch)
    assert cli.main(["regress", str(case)]) == 1


def test_there_are_twelve_planted_changes_at_least() -> None:
    assert len(PLANTED) >= 12
    assert set(QUICK) <= set(PLANTED)
