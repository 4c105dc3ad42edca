"""What all tests share: hypothesis draws the same examples in every run, and programs hear Ctrl-C.

A shell that runs tests in the background has SIGINT ignored, and whatever they start inherits that. Tests
that tests/thorough.txt or tests/long.txt names are marked as such. Files whose tests replay with nodes' code
take longest: they are begun first, so that none of them is still at work when all others have ended.
"""

import signal
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("flexarm", derandomize=True, max_examples=50, deadline=None)
settings.load_profile("flexarm")
signal.signal(signal.SIGINT, signal.default_int_handler)
TESTS = Path(__file__).parent / "tests"
LISTED = {
    mark: frozenset((TESTS / f"{mark}.txt").read_text(encoding="utf8").splitlines())
    for mark in ("thorough", "long")
}


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what takes long, as a function or in one of its examples, and put what takes longest first."""
    for item in items:
        for mark, names in LISTED.items():
            if item.nodeid in names or item.nodeid.partition("[")[0] in names:
                item.add_marker(mark)
    items.sort(key=lambda item: item.get_closest_marker("unhurried") is None)
