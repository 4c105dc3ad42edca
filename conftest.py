"""What all tests share: hypothesis draws the same examples in every run, and programs hear Ctrl-C.

A shell that runs tests in the background has SIGINT ignored, and whatever they start inherits that. Tests
that tests/thorough.txt names are marked as such. Files whose tests replay with nodes' code take longest: they
are begun first, so that none of them is still at work when all others have ended.
"""

import signal
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("flexarm", derandomize=True, max_examples=50, deadline=None)
settings.load_profile("flexarm")
signal.signal(signal.SIGINT, signal.default_int_handler)
LIST = Path(__file__).parent / "tests" / "thorough.txt"
THOROUGH = frozenset(LIST.read_text(encoding="utf8").splitlines())


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what takes long, and put what takes longest first."""
    for item in items:
        if item.nodeid.partition("[")[0] in THOROUGH:
            item.add_marker("thorough")
    items.sort(key=lambda item: item.get_closest_marker("unhurried") is None)
