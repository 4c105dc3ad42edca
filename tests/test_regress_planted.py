"""Planted changes are named by the regression, each where it shows first; unchanged code passes."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from planted_changes import GOLDEN, PLANTED, with_bad_samples  # noqa: E402

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_bringup.regress.making import Source, make_case  # noqa: E402
from flexarm_bringup.replaying import compare  # noqa: E402
from flexarm_bringup.replaying.compare import IGNORED, Tolerance  # noqa: E402
from flexarm_bringup.topics import NAMESPACE  # noqa: E402
from flexarm_model.bodies import kept_beams  # noqa: E402


class Recording:
    """Plants, and keeps what it replaces beside what it puts there.

    Attributes:
        replaced: Functions, each with the one in its place.
    """

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self._patch = patch
        self.replaced: list[tuple[Callable[..., Any], Callable[..., Any]]] = []

    def setattr(self, target: Any, name: str, value: Any) -> None:
        """Replace an attribute; AttributeError where there is none."""
        self.replaced.append((getattr(target, name), value))
        self._patch.setattr(target, name, value)

    def setitem(self, items: Any, name: str, value: Any) -> None:
        """Replace an item; KeyError where there is none."""
        self.replaced.append((items[name], value))
        self._patch.setitem(items, name, value)


def calls(function: Callable[..., Any]) -> Iterator[tuple[object, ...]]:
    """Yield the positional arguments, with as few and with as many as a function takes."""
    known = inspect.signature(function).parameters.values()
    placed = [p for p in known if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    yield (None,) * sum(p.default is p.empty for p in placed)
    yield (None,) * len(placed)


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make a case with something for every guard."""
    folder = tmp_path_factory.mktemp("planted")
    bag = with_bad_samples(check_bag(GOLDEN), folder / "recorded")
    return make_case(folder / "cases" / "bad_samples", Source(bag.path)).folder


def test_unchanged_code_passes(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["regress", str(case.parent)]) == 0
    assert "1 of 1 cases pass" in capsys.readouterr().out


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_change_is_named(
    name: str, case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planted = PLANTED[name]
    planted.plant(monkeypatch)
    monkeypatch.setattr(kept_beams, "_KEPT", {})  # else what was reduced before the change is used on
    report = tmp_path / "report.json"
    assert cli.main(["regress", str(case), "--json", str(report)]) == 1
    (found,) = json.loads(report.read_text())["cases"]
    assert found["first"]["topic"] == f"{NAMESPACE}/{planted.topic}"
    assert found["first"]["field"].startswith(planted.field)
    assert found["reason"] in capsys.readouterr().out
    assert found["first"]["text"].endswith((" expected", " missing"))
    assert "no messages any more" not in found["first"]["text"]  # it raised: that is another change


def test_looser_defaults_hide_nothing(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compare, "TOLERANCES", (Tolerance("*", IGNORED, 0.0),))
    PLANTED["camera stamped 1 ms late"].plant(monkeypatch)
    assert cli.main(["regress", str(case)]) == 1


def test_there_are_twelve_planted_changes_at_least() -> None:
    assert len(PLANTED) >= 12


@pytest.mark.parametrize("name", PLANTED)
def test_a_planted_change_is_called_as_what_it_replaces(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    patch = Recording(monkeypatch)
    PLANTED[name].plant(cast(pytest.MonkeyPatch, patch))  # raises where nothing has that name any more
    assert patch.replaced
    for original, planted in patch.replaced:
        for call in calls(original):
            inspect.signature(planted).bind(*call)


def test_a_change_that_is_called_otherwise_is_found() -> None:
    def two(unit: str, specs: str) -> None: ...

    with pytest.raises(TypeError):
        inspect.signature(lambda spec: None).bind(*next(calls(two)))
