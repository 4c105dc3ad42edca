"""pytest plugin of flexarm: folders with an ``expect.yaml`` of a bag regression are collected as tests.

It is loaded into every pytest of the environment, also those of other projects. It lies outside of the
package and imports nothing of it before a case runs: that would limit their BLAS to one thread.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

EXPECT_FILE = "expect.yaml"
METADATA = "metadata.yaml"  # of every bag
FORMAT = "flexarm-regress"
BAGS = ("bag", "golden")  # folders of a case
HIDING = ("skip", "skipif", "xfail")  # marks under which a case would pass that does not
MARK = "flexarm_regress"
# what YAML raises at a date that is none, at a number without digits, or at lists within lists without end
_NO_VALUE = (ValueError, LookupError, TypeError, AttributeError, RecursionError)


class Diverged(Exception):
    """The case does not pass; the text is what a reader of the report needs."""


class CaseFile(pytest.File):
    """A folder of a case."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the one test of the case."""
        yield CaseItem.from_parent(self, name=self.path.parent.name)


class CaseItem(pytest.Item):
    """Plays the bag of a case and compares."""

    def __init__(self, **kwargs: Any) -> None:
        """Take the marks that the case asks for."""
        super().__init__(**kwargs)
        self.add_marker(MARK)
        for name in _marks(self.path):
            self.add_marker(name)

    def runtest(self) -> None:
        """Judge the case.

        Raises:
            Diverged: It does not pass.
        """
        from flexarm_bringup.regress.judge import PASSED, judge
        from flexarm_bringup.regress.page import build_page

        verdict = judge(self.path.parent)
        if verdict.code != PASSED:
            raise Diverged(build_page(self.path.parent, [verdict], with_figures=False).to_text())

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the report of the case instead of a traceback."""
        if isinstance(excinfo.value, Diverged):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return where the case lies and what it is called."""
        return self.path, 0, f"flexarm regress: {self.name}"


def pytest_configure(config: pytest.Config) -> None:
    """Make the mark of all cases known."""
    config.addinivalue_line("markers", f"{MARK}: a recorded bag played again and compared (flexarm)")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Have the folder of a case looked into whatever it is called; one that is left out stays out.

    pytest skips folders by their names (norecursedirs): build, dist, venv, .hidden and others. It is asked
    again without these; what --ignore and collect_ignore say, it still obeys.
    """
    if not _is_case(collection_path):
        return None
    main: Any = config.pluginmanager.get_plugin("main")
    return bool(main.pytest_ignore_collect(collection_path, _WithoutNames(config)))


class _WithoutNames:
    """The configuration of a pytest that skips no folder for its name."""

    def __init__(self, config: pytest.Config) -> None:
        """Take all else from a configuration."""
        self._config = config

    def __getattr__(self, name: str) -> Any:
        """Return what the configuration has."""
        return getattr(self._config, name)

    def getini(self, name: str) -> Any:
        """Return a setting of its file."""
        return [] if name == "norecursedirs" else self._config.getini(name)


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect an ``expect.yaml`` of flexarm, also where it is gone; leave those of others alone."""
    if file_path.name == METADATA and (expect := _gone_expectations(file_path)) is not None:
        return CaseFile.from_parent(parent, path=expect)
    if file_path.name != EXPECT_FILE or not is_ours(file_path):
        return None
    return CaseFile.from_parent(parent, path=file_path)


def is_ours(expect: Path) -> bool:
    """Return whether an ``expect.yaml`` is of a case, as ``flexarm regress`` does.

    One that neither speaks of our format nor has a bag beside it is of another project. One of a case that is
    emptied, damaged or cannot be read is a test that fails, not one that is missing.
    """
    if any(os.path.isdir(expect.parent / name) for name in BAGS):
        return True
    try:
        return FORMAT in expect.read_text(encoding="utf8", errors="replace")
    except OSError:
        return True


def _is_case(folder: Path) -> bool:
    """Return whether a folder is that of a case, also of one whose ``expect.yaml`` is gone."""
    expect = folder / EXPECT_FILE
    if os.path.lexists(expect):
        return is_ours(expect)
    return all(os.path.isdir(folder / name) for name in BAGS)


def _gone_expectations(metadata: Path) -> Path | None:
    """Return the missing ``expect.yaml`` of a case whose golden bag this describes; else None."""
    bag, golden = BAGS
    expect = metadata.parent.parent / EXPECT_FILE
    is_golden = metadata.parent.name == golden and os.path.isdir(expect.parent / bag)
    return expect if is_golden and not os.path.lexists(expect) else None


def _marks(path: Path) -> list[str]:
    """Return the marks of a case; what is not understood is none, and the case fails when it runs."""
    import yaml

    try:
        content = yaml.safe_load(path.read_text(encoding="utf8"))
    except (OSError, yaml.YAMLError, *_NO_VALUE):
        return []
    marks = content.get("markers", []) if isinstance(content, dict) else []
    return [mark for mark in marks if _is_mark(mark)] if isinstance(marks, list) else []


def _is_mark(name: Any) -> bool:
    """Return whether pytest can give an item this mark, and the item can still fail."""
    return isinstance(name, str) and name not in ("", *HIDING) and not name.startswith("_")
