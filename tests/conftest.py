"""Let the tests of this folder import what lies beside them (pytest's importlib mode does not)."""

import importlib.machinery
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def bootstrap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the program ``flexarm`` as a module that keeps what it makes in a folder of the test."""
    path = Path(__file__).resolve().parents[1] / "flexarm"
    loader = importlib.machinery.SourceFileLoader("flexarm_bootstrap", str(path))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    monkeypatch.setattr(module, "STATE", tmp_path / ".flexarm")
    return module
