"""What the locked files list is installed, whatever was released since; and they list all that is needed."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

SETTINGS = Path(sys.prefix, "pyvenv.cfg")  # on a rig the environment sees what apt has installed, too
IS_OWN = SETTINGS.exists() and "include-system-site-packages = false" in SETTINGS.read_text()


def write_wheel(folder: Path, name: str, version: str, metadata: str = "") -> str:
    """Write an empty wheel and return its SHA-256."""
    path, info = folder / f"{name}-{version}-py3-none-any.whl", f"{name}-{version}.dist-info"
    members = {
        "METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n{metadata}",
        "WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    record = "".join(f"{info}/{member},,\n" for member in (*members, "RECORD"))
    with zipfile.ZipFile(path, "w") as wheel:
        for member, text in {**members, "RECORD": record}.items():
            wheel.writestr(f"{info}/{member}", text)
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_a_later_release_of_something_wanted_with_an_extra_is_not_asked_for(
    bootstrap: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A release of the day came before the pinned one, and every fresh clone ended with 1."""
    monkeypatch.setattr(bootstrap, "compile_python", lambda *_: None)  # the whole environment, for 20 s
    monkeypatch.setattr(bootstrap, "ELSEWHERE", ())  # this is into a folder of the test
    index, target = tmp_path / "index", tmp_path / "target"
    index.mkdir()
    pinned = {
        "a": write_wheel(index, "a", "1", "Requires-Dist: b[more]>=1\n"),
        "b": write_wheel(index, "b", "1", "Provides-Extra: more\n"),
    }
    write_wheel(index, "b", "2", "Provides-Extra: more\n")
    lock_file = tmp_path / "requirements.lock"
    lock_file.write_text("".join(f"{name}==1 --hash=sha256:{digest}\n" for name, digest in pinned.items()))
    place = bootstrap.Place(Path(sys.prefix), tmp_path, False)
    variables = {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(index), "PIP_TARGET": str(target)}
    with bootstrap.only_one() as lock:
        bootstrap.pip_install(
            place, lock_file, "installing", {**bootstrap.inherited(False), **variables}, lock
        )
    assert sorted(path.name for path in target.iterdir()) == ["a-1.dist-info", "b-1.dist-info"]


@pytest.mark.skipif(not IS_OWN, reason="what apt installs is not the lock's")
def test_the_environment_has_all_that_its_packages_ask_for() -> None:
    done = subprocess.run([sys.executable, "-m", "pip", "check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
