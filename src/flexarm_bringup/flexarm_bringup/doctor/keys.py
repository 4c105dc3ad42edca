"""Security that is asked for: settings, the keys of every enclave of flexarm, libraries of the middleware."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.processes.graph import rig_graph
from flexarm_bringup.processes.secured import WATCH_ENCLAVE
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.enclave_keys import FILES, missing_keys
from flexarm_model.process.security import (
    KEYSTORE,
    OVERRIDE,
    TOOLS,
    SecurityError,
    check_security,
    is_security_asked_for,
    with_enclave,
)

STARTED = (WATCH_ENCLAVE, *(f"{NAMESPACE}/{row.name}" for row in rig_graph()))  # by flexarm rig
_OTHERS = ("tools", "operator", "recorder", "markers", "drift", "commander", "excite")
BESIDE = tuple(f"{NAMESPACE}/{name}" for name in _OTHERS)
SUBJECT = "security"
MAKE = "ros2 security create_enclave {} ENCLAVE for each, then create_permission as flexarm security says"
LIBRARIES = "flexarm_bringup.doctor.libraries_node"
ALONE = {"ROS_DOMAIN_ID": "0", "ROS_STATIC_PEERS": ""}  # what is wrong with these is told elsewhere


def look_at_security(
    environment: Mapping[str, str] = os.environ, *, has_middleware: bool = True
) -> Iterator[Finding]:
    """Yield whether nodes and tools get the security that is asked for.

    Args:
        environment: Of the nodes.
        has_middleware: Whether there is one to be asked for its libraries.
    """
    if not is_security_asked_for(environment):
        yield Finding("ok", SUBJECT, "not asked for")
        return
    store = environment.get(KEYSTORE, "")
    found = []
    try:
        check_security(with_enclave((), TOOLS, environment), environment)
    except SecurityError as error:
        means, _, cure = str(error).partition("; ")
        found = [Finding("FAULT", SUBJECT, means, cure)]
        if not means.startswith(KEYSTORE) or not os.path.isdir(store):
            yield from found
            return
        if _folder(store, environment.get(OVERRIDE) or TOOLS).is_dir():
            found = []  # which files are not in it is told with those of all others
    found += [*_keys(store, environment), *(ask_middleware(environment) if has_middleware else ())]
    yield from found
    if not any(item.verdict == "FAULT" for item in found):
        yield Finding("ok", SUBJECT, f"keys in {store}, enforced")


def _folder(store: str, enclave: str) -> Path:
    return Path(store, "enclaves", enclave.strip("/"))


def _keys(store: str, environment: Mapping[str, str]) -> Iterator[Finding]:
    override = environment.get(OVERRIDE)
    enclaves = (override,) if override else (*STARTED, *BESIDE)
    there = {enclave: _folder(store, enclave) for enclave in enclaves}
    there = {enclave: folder for enclave, folder in there.items() if folder.is_dir()}
    lacking: dict[tuple[str, ...], list[str]] = {}
    for enclave, folder in there.items():
        lacking.setdefault(missing_keys(folder), []).append(enclave)
    for files, lacks in lacking.items():
        if files:
            text = f"{KEYSTORE}: '{store}': no {', '.join(files)} for {', '.join(lacks)}"
            yield Finding("FAULT", SUBJECT, text, MAKE.format(store))
    if not override:
        yield from _absent(store, [enclave for enclave in STARTED if enclave not in there])


def _absent(store: str, enclaves: list[str]) -> Iterator[Finding]:
    """Yield for whom there are no keys; where there are none for any node, only tools may be meant to run."""
    if not enclaves:
        return
    text = f"{KEYSTORE}: '{store}': no keys for {', '.join(enclaves)}: flexarm rig refuses"
    if len(enclaves) == len(STARTED):
        yield Finding("hint", SUBJECT, text, f"right where only tools run; else {MAKE.format(store)}")
    else:
        yield Finding("FAULT", SUBJECT, text, MAKE.format(store))


def ask_middleware(environment: Mapping[str, str]) -> Iterator[Finding]:
    """Yield what a middleware refuses that is asked for a node with empty keys, in a process of its own.

    One without the libraries says that it has none; one with them refuses the keys, and makes no node either.
    """
    with TemporaryDirectory(prefix="flexarm_doctor_") as store:
        (enclave := Path(store, "enclaves", TOOLS.strip("/"))).mkdir(parents=True)
        for name in FILES:
            (enclave / name).touch()
        asked = {**environment, **ALONE, KEYSTORE: store, OVERRIDE: ""}
        command = [sys.executable, "-m", LIBRARIES]
        done = subprocess.run(command, env=asked, capture_output=True, text=True, check=False)
    if done.returncode or done.stdout:
        means, _, cure = (done.stdout.strip() or _last(done.stderr)).partition("; ")
        yield Finding("FAULT", SUBJECT, means, cure or "install a middleware with security libraries")


def _last(text: str) -> str:
    return (text.strip().splitlines() or ["the middleware cannot be asked"])[-1]
