"""A case of the regression: a folder with a recorded bag, what must come of it, and how near is equal.

    CASE/expect.yaml    what is expected, see below
    CASE/bag/           what was recorded: rosbag2, MCAP or sqlite3
    CASE/golden/        what estimator, controller and model made of it when it was last reviewed

``expect.yaml`` holds SHA-256 and number of messages of both bags, so that neither changes unseen, and all
tolerances, so that a change of defaults loosens nothing. It holds a SHA-256 of the tolerances with which
``golden/`` was reviewed, too: none is changed unseen.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from flexarm_bringup.regress.pinned import EXPECT_FILE as EXPECT_FILE
from flexarm_bringup.regress.pinned import Pinned
from flexarm_bringup.replaying.compare import IGNORED, Tolerance
from flexarm_model.settings.strict_yaml import Section, read_yaml

FORMAT = "flexarm-regress/1"
BAG, GOLDEN, REVIEWED = "bag", "golden", "tolerances_sha256"
BY_NODE = "parameters by node, as {controller: {law: pd}}"
HIDING = ("skip", "skipif", "xfail")  # marks of pytest; flexarm_pytest ignores them, too
_HEAD = """\
# What must come of the bag beside it: `flexarm regress` compares, `--update` renews golden/ and this file.
# A number may differ by atol + rtol |number|, atol in its SI unit; the first pattern that fits a field holds,
# and what none fits must be equal.
"""


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        folder: Where it lies.
        about: What it is, for the reader.
        bag: What was recorded.
        golden: What came of it.
        tolerances: The first that fits a field holds.
        manipulator: Name, or file by its path from ``folder``; empty: the description kept in the bag.
        preset: Of that manipulator.
        settings: Parameters of the nodes over those kept in the bag, by node, as JSON; empty: none.
        markers: Marks that pytest gives the case.
        reviewed: SHA-256 of the tolerances with which ``golden`` was reviewed; None for these.
    """

    folder: Path
    about: str
    bag: Pinned
    golden: Pinned
    tolerances: tuple[Tolerance, ...]
    manipulator: str = ""
    preset: str = ""
    settings: str = ""
    markers: tuple[str, ...] = ()
    reviewed: str | None = None

    @property
    def is_reviewed(self) -> bool:
        """Whether the tolerances are still those with which the golden bag was reviewed."""
        return self.reviewed in (None, _digest_of(self.tolerances))


def read_case(folder: Path) -> Case:
    """Read the expectations of a case.

    Raises:
        ConfigError: They are not understood; the message names file, key, value and what is allowed.
    """
    path = folder / EXPECT_FILE
    section = Section(read_yaml(path), str(path))
    section.choice("format", [FORMAT])
    case = Case(
        folder,
        section.text("about", ""),
        _read_pinned(section.section(BAG), folder),
        _read_pinned(section.section(GOLDEN), folder),
        tuple(_read_tolerance(item) for item in section.items("tolerances")),
        section.text("manipulator", ""),
        section.text("preset", ""),
        _read_settings(section),
        _read_markers(section),
        section.text(REVIEWED, ""),
    )
    section.done()
    if case.preset and not case.manipulator:
        raise section.error("preset", case.preset, "needs a manipulator; without one, it is as the bag says")
    if not _is_replaceable(case):
        told = section.section(GOLDEN).text("path")
        allowed = f"a folder of this case alone, apart from {BAG}.path, neither in the other"
        raise section.error(f"{GOLDEN}.path", told, f"--update replaces it; expected {allowed}")
    return case


def are_by_node(settings: object) -> bool:
    """Return whether something is a mapping of nodes to mappings."""
    return isinstance(settings, dict) and all(isinstance(values, dict) for values in settings.values())


def write_case(case: Case, name: str = EXPECT_FILE) -> None:
    """Write the expectations of a case into its folder, under that name."""
    content: dict[str, Any] = {"format": FORMAT, "about": case.about}
    content |= {key: getattr(case, key) for key in ("manipulator", "preset") if getattr(case, key)}
    if case.settings:
        content["settings"] = json.loads(case.settings)
    if case.markers:
        content["markers"] = list(case.markers)
    content |= {
        BAG: _pinned_content(case.bag, case.folder),
        GOLDEN: _pinned_content(case.golden, case.folder),
    }
    content["tolerances"] = [_tolerance_content(item) for item in case.tolerances]
    content[REVIEWED] = _digest_of(case.tolerances)
    text = yaml.safe_dump(content, sort_keys=False, width=100, allow_unicode=True)
    (case.folder / name).write_text(_HEAD + text, encoding="utf8")


def _read_pinned(section: Section, folder: Path) -> Pinned:
    sums, counts = section.section("sha256"), section.section("counts")
    pinned = Pinned(
        folder / section.text("path"),
        {name: sums.text(name) for name in sums.names(dots=True)},
        {name: counts.count(name) for name in counts.names(dots=True)},
    )
    if not pinned.sha256 or not pinned.counts:
        raise section.error(
            "", section.text("path"), "needs at least one SHA-256 and one topic with its count"
        )
    section.done()
    return pinned


def _is_replaceable(case: Case) -> bool:
    """Return whether the golden bag can be replaced without harm to what was recorded, or to another case."""
    bag, golden = case.bag.path.resolve(), case.golden.path.resolve()
    owner = next((folder for folder in golden.parents if (folder / EXPECT_FILE).exists()), None)
    return owner == case.folder.resolve() and not (bag.is_relative_to(golden) or golden.is_relative_to(bag))


def _read_settings(section: Section) -> str:
    """Return the parameters as JSON; empty where none are given."""
    settings = section.take("settings", None)
    if settings is not None and not are_by_node(settings):
        raise section.error("settings", settings, f"expected {BY_NODE}")
    try:
        return "" if settings is None else json.dumps(settings)
    except TypeError:  # YAML takes a date for something of its own
        allowed = "expected numbers, texts, true, false or lists of them, a date in quotes"
        raise section.error("settings", settings, allowed) from None


def _read_markers(section: Section) -> tuple[str, ...]:
    """Return the marks, without those under which pytest would let a case pass that does not."""
    markers = section.texts("markers", ())
    for name in markers:
        if not name or name.startswith("_") or name in HIDING:
            raise section.error("markers", name, f"is no mark of a case, nor are {', '.join(HIDING)}")
    return markers


def _read_tolerance(section: Section) -> Tolerance:
    pattern = section.text("field")
    if section.flag("ignored"):
        tolerance = Tolerance(pattern, IGNORED, 0.0)
    else:
        atol, rtol = (section.quantity(key, "ratio", 0.0, at_least=0.0) for key in ("atol", "rtol"))
        tolerance = Tolerance(pattern, atol, rtol)
    section.done()
    return tolerance


def _pinned_content(pinned: Pinned, folder: Path) -> dict[str, Any]:
    path = pinned.path.relative_to(folder) if pinned.path.is_relative_to(folder) else pinned.path
    return {"path": str(path), "sha256": dict(pinned.sha256), "counts": dict(pinned.counts)}


def _tolerance_content(tolerance: Tolerance) -> dict[str, Any]:
    if tolerance.atol == IGNORED:
        return {"field": tolerance.pattern, "ignored": True}
    return {"field": tolerance.pattern, "atol": tolerance.atol, "rtol": tolerance.rtol}


def _digest_of(tolerances: Sequence[Tolerance]) -> str:
    content = json.dumps([_tolerance_content(item) for item in tolerances])
    return hashlib.sha256(content.encode()).hexdigest()
