"""What the environment says and ROS does not keep to, or dies of, is named by ``flexarm doctor``."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from flexarm_bringup.arguments import STDOUT
from flexarm_bringup.doctor import command, keys
from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.doctor.installation import look_at_installation
from flexarm_bringup.doctor.keys import BESIDE, STARTED, look_at_security
from flexarm_bringup.doctor.middleware import look_at_middleware
from flexarm_bringup.doctor.network import look_at_network
from flexarm_bringup.doctor.places import look_at_places
from flexarm_bringup.doctor.profiles import find_unreadable
from flexarm_bringup.processes.surroundings import PROFILES, defaults
from flexarm_model.process.enclave_keys import FILES

RANGE, LOCAL, PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS"
RMW, ASSERTED = "RMW_IMPLEMENTATION", "RCL_ASSERT_RMW_ID_MATCHES"
INDEX = "share/ament_index/resource_index/rmw_typesupport"
ENFORCED = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}


def told(findings: Iterator[Finding]) -> list[tuple[str, str, str]]:
    """Return the findings that are not ok; one that is has no cure."""
    found = list(findings)
    assert all(bool(item.cure) == (item.verdict != "ok") for item in found)
    return [(item.verdict, item.text, item.cure) for item in found if item.verdict != "ok"]


@pytest.fixture
def prefix(tmp_path: Path) -> dict[str, str]:
    """Return an environment in which one middleware is installed."""
    (tmp_path / INDEX).mkdir(parents=True)
    for name in ("rmw_fastrtps_cpp", "rmw_implementation"):
        (tmp_path / INDEX / name).write_text("")
    return {"AMENT_PREFIX_PATH": f"/nowhere:{tmp_path}"}


@pytest.mark.parametrize(
    ("asked", "text", "cure"),
    [
        (
            {RMW: "rmw_cyclonedds_cpp"},
            f"{RMW}: 'rmw_cyclonedds_cpp': no such middleware; installed: rmw_fastrtps_cpp",
            f"export {RMW}=rmw_fastrtps_cpp, or install rmw_cyclonedds_cpp",
        ),
        (
            {RMW: "rmw_fastrtps_cpp", ASSERTED: "rmw_implementation"},
            f"{ASSERTED}: 'rmw_implementation': no such middleware; installed: rmw_fastrtps_cpp",
            f"export {ASSERTED}=rmw_fastrtps_cpp, or install rmw_implementation",
        ),
        ({RMW: "", ASSERTED: ""}, "", ""),
        ({RMW: "rmw_fastrtps_cpp", ASSERTED: "rmw_fastrtps_cpp"}, "", ""),
    ],
)
def test_a_middleware_that_is_not_installed_is_named(
    asked: dict[str, str], text: str, cure: str, prefix: dict[str, str]
) -> None:
    """A tool that listened was ended by rcl, without a word in the JSON; offline nothing was said."""
    found = told(look_at_middleware(prefix | asked))
    assert found == ([("FAULT", text, cure)] if text else [])


def test_two_middlewares_that_are_asked_for_at_once_are_a_fault(
    prefix: dict[str, str], tmp_path: Path
) -> None:
    (tmp_path / INDEX / "rmw_other_cpp").write_text("")
    asked = {RMW: "rmw_other_cpp", ASSERTED: "rmw_fastrtps_cpp"}
    ((verdict, text, cure),) = told(look_at_middleware(prefix | asked))
    assert (verdict, cure) == ("FAULT", f"unset {ASSERTED}")
    assert text.startswith(f"{RMW}: 'rmw_other_cpp' and {ASSERTED}: 'rmw_fastrtps_cpp'")


def test_without_any_middleware_it_is_said_how_to_get_one() -> None:
    cure = "./flexarm build, or source install/setup.bash"
    assert told(look_at_middleware({})) == [("FAULT", "installed: none", cure)]


@pytest.mark.parametrize("name", ["FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"])
def test_profiles_that_are_not_there_are_named(name: str, prefix: dict[str, str], tmp_path: Path) -> None:
    ((verdict, text, cure),) = told(look_at_middleware(prefix | {name: str(tmp_path)}))
    assert (verdict, text.startswith(f"{name}: '{tmp_path}': no such file")) == ("FAULT", True)
    assert cure == f"unset {name}, or name a file of profiles"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("garbage <", "it is no XML (syntax error: line 1, column 0)"),
        ("", "it is no XML (no element found: line 1, column 0)"),
        ("<dds><profiles></dds>", "it is no XML (mismatched tag: line 1, column 17)"),
        ("<dds/>more", "it is no XML (junk after document element: line 1, column 6)"),
        ("<participant/>", "it begins with <participant>, expected <dds>, <profiles>, "),
        ("<x:dds xmlns:x='y'/>", "it begins with <x:dds>, expected <dds>, <profiles>, "),
    ],
)
def test_profiles_that_fast_dds_cannot_read_are_a_fault(
    content: str, reason: str, prefix: dict[str, str], tmp_path: Path
) -> None:
    """Nothing was said of them, and flexarm left its own settings out."""
    path = tmp_path / "mine.xml"
    path.write_text(content)
    ((verdict, text, _),) = told(look_at_middleware(prefix | {PROFILES: str(path)}))
    assert (verdict, text.startswith(f"{PROFILES}: '{path}': {reason}")) == ("FAULT", True), text
    assert "flexarm leaves its own settings of the middleware out for it" in text


@pytest.mark.parametrize("content", ["<dds/>", "<profiles/>", "<dds xmlns='http://a'><log/></dds>"])
def test_profiles_of_the_user_are_told_to_put_those_of_flexarm_off(
    content: str, prefix: dict[str, str], tmp_path: Path
) -> None:
    path = tmp_path / "mine.xml"
    path.write_text(content)
    ((verdict, text, cure),) = told(look_at_middleware(prefix | {PROFILES: str(path)}))
    assert (verdict, cure) == ("hint", f"right where you mean it, else unset {PROFILES}")
    assert text == f"{PROFILES}: '{path}': flexarm leaves its own settings of the middleware out for it"


def test_profiles_of_flexarm_itself_are_nothing_to_tell(prefix: dict[str, str]) -> None:
    """Who starts nodes by hand names them."""
    found = defaults({})[PROFILES]
    assert not find_unreadable(Path(found))
    assert not told(look_at_middleware(prefix | {PROFILES: found}))


ANYBODY, DEPRECATED = (
    ("hint", "SUBNET: anybody on the net"),
    ("hint", "'1': this machine only, by a deprecated"),
)


@pytest.mark.parametrize(
    ("asked", "wanted"),
    [
        ({RANGE: "LOCALHOST"}, []),
        ({RANGE: "LOCALHOST", LOCAL: "0"}, []),
        ({RANGE: "LOCALHOST", LOCAL: "1"}, [DEPRECATED]),
        ({LOCAL: "1"}, [DEPRECATED]),
        ({RANGE: "SUBNET", LOCAL: "1"}, [("FAULT", f"ROS ignores {RANGE} 'SUBNET' for it")]),
        (
            {RANGE: "OFF", LOCAL: "1", PEERS: "lab"},
            [("FAULT", f"ROS ignores {PEERS} 'lab' and {RANGE} 'OFF' for it")],
        ),
        (
            {RANGE: "LOCALHOST", PEERS: "10.0.0.5;lab"},
            [("hint", f"{PEERS}: 10.0.0.5, lab may see and command")],
        ),
        ({PEERS: ";"}, [ANYBODY]),
        ({PEERS: "lab"}, [ANYBODY, ("hint", f"{PEERS}: lab may see and command")]),
        (
            {RANGE: "OFF", PEERS: "lab"},
            [("FAULT", "OFF: nodes do not"), ("hint", f"lab are not looked for with {RANGE}=OFF")],
        ),
    ],
)
def test_who_else_can_reach_the_rig_is_told_as_ros_takes_it(
    asked: dict[str, str], wanted: list[tuple[str, str]]
) -> None:
    """With peers it was "this machine only", and what comes before the range was not looked at."""
    found = told(look_at_network(asked))
    assert [verdict for verdict, _, _ in found] == [verdict for verdict, _ in wanted]
    assert all(words in text for (_, text, _), (_, words) in zip(found, wanted, strict=True))


def test_with_peers_nobody_is_told_that_this_machine_is_alone() -> None:
    found = look_at_network({RANGE: "LOCALHOST", PEERS: "lab"})
    assert not any("this machine only" in item.text for item in found)


def test_folders_that_cannot_be_written_are_named_by_their_variable(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    good = {"ROS_LOG_DIR": str(tmp_path / "logs"), "FLEXARM_CACHE": str(tmp_path / "new" / "cache")}
    assert not told(look_at_places(good))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]  # looking leaves nothing behind
    bad = {name: str(tmp_path / "file" / "x") for name in good}
    (logs, code) = told(look_at_places(bad))
    assert logs[0] == "FAULT" and logs[1].startswith(f"ROS_LOG_DIR: {tmp_path}/file/x: cannot be written (")
    assert code[0] == "hint" and code[1].startswith(f"FLEXARM_CACHE: {tmp_path}/file/x: cannot be written (")
    home = {"ROS_LOG_DIR": "", "ROS_HOME": str(tmp_path / "file")}
    ((_, text, _),) = told(look_at_places(good | home))
    assert text.startswith(f"ROS_HOME: {tmp_path}/file/log: ")


@pytest.fixture
def store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Return what asks for security, with whole keys of all enclaves, of a middleware with libraries."""
    monkeypatch.setattr(keys, "ask_middleware", lambda environment: ())
    for enclave in (*STARTED, *BESIDE):
        folder = tmp_path / "enclaves" / enclave.strip("/")
        folder.mkdir(parents=True)
        for name in FILES:
            (folder / name).write_text("")
    return {**ENFORCED, "ROS_SECURITY_KEYSTORE": str(tmp_path)}


def test_with_all_keys_security_is_ok(store: dict[str, str]) -> None:
    assert [item.verdict for item in look_at_security(store)] == ["ok"]


@pytest.mark.parametrize("enclave", [STARTED[0], STARTED[-1], *BESIDE])
@pytest.mark.parametrize("files", [*((name,) for name in FILES), FILES])
def test_every_file_that_an_enclave_lacks_is_a_fault_and_nothing_is_ok(
    files: tuple[str, ...], enclave: str, store: dict[str, str], tmp_path: Path
) -> None:
    """An empty folder was "ok, enforced"."""
    for name in files:
        (tmp_path / "enclaves" / enclave.strip("/") / name).unlink()
    (only,) = look_at_security(store)
    assert (only.verdict, "create_enclave" in only.cure) == ("FAULT", True)
    assert only.text == f"ROS_SECURITY_KEYSTORE: '{tmp_path}': no {', '.join(files)} for {enclave}"


def test_a_key_may_lie_in_a_device(store: dict[str, str], tmp_path: Path) -> None:
    key = tmp_path / "enclaves" / "flexarm" / "guard" / "key.pem"
    key.rename(key.with_suffix(".p11")).write_text("pkcs11:token=rig")
    assert not told(look_at_security(store))
    key.with_suffix(".p11").write_text("nothing")
    assert "no key.pem for /flexarm/guard" in told(look_at_security(store))[0][1]


def test_enclaves_that_a_rig_needs_are_missed_where_it_has_some(
    store: dict[str, str], tmp_path: Path
) -> None:
    folders = [tmp_path / "enclaves" / enclave.strip("/") for enclave in STARTED]
    folders[0].rename(tmp_path / "away")
    ((verdict, text, _),) = told(look_at_security(store))
    assert (verdict, f"no keys for {STARTED[0]}: flexarm rig refuses" in text) == ("FAULT", True)
    for folder in folders[1:]:
        folder.rename(tmp_path / folder.name)
    ((verdict, text, _),) = told(look_at_security(store))  # a machine for tools only
    assert (verdict, all(enclave in text for enclave in STARTED)) == ("hint", True)
    everybody = {"ROS_SECURITY_ENCLAVE_OVERRIDE": "/flexarm/tools"}
    assert not told(look_at_security(store | everybody))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"ROS_SECURITY_ENABLE": "True"}, "ROS_SECURITY_ENABLE: 'True'"),
        ({"ROS_SECURITY_STRATEGY": "Permissive"}, "ROS_SECURITY_STRATEGY: 'Permissive'"),
        ({"ROS_SECURITY_KEYSTORE": ""}, "ROS_SECURITY_KEYSTORE: '': no folder of keys"),
        ({"ROS_SECURITY_ENCLAVE_OVERRIDE": "/lab"}, "it has no keys for the enclave /lab"),
    ],
)
def test_security_that_is_not_enforced_is_a_fault(
    changes: dict[str, str], words: str, store: dict[str, str]
) -> None:
    (only,) = look_at_security(store | changes)
    assert (only.verdict, words in only.text) == ("FAULT", True)


def test_a_middleware_without_libraries_is_a_fault_beside_all_keys(
    store: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = Finding("FAULT", "security", "it has no libraries", "install others")
    monkeypatch.setattr(keys, "ask_middleware", lambda environment: (missing,))
    assert list(look_at_security(store)) == [missing]


@pytest.mark.ros
def test_the_installed_middleware_is_asked_for_its_libraries() -> None:
    """With them the keys of an empty enclave are missed, which is no fault of the middleware's."""
    pytest.importorskip("rclpy")
    for item in keys.ask_middleware({**os.environ, **ENFORCED}):
        assert (item.verdict, item.subject) == ("FAULT", "security") and "security libraries" in item.text


def test_a_middleware_that_is_missing_is_not_asked_for_its_libraries(
    store: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(environment: object) -> tuple[Finding, ...]:
        """Fail: nobody is there to be asked."""
        raise AssertionError

    monkeypatch.setattr(keys, "ask_middleware", refuse)
    found = look_at_installation({**os.environ, **store, RMW: "rmw_none"})
    assert "middleware" in {item.subject for item in found if item.verdict == "FAULT"}


def test_json_is_written_whatever_ends_the_process_that_listens(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    monkeypatch.setattr(command, "look_at_machine", lambda folder: iter(()))
    monkeypatch.setattr(command, "look_at_installation", lambda: iter(()))
    monkeypatch.setattr(command, "GRAPH", "no_such_module")
    args = argparse.Namespace(json=STDOUT, offline=False, folder=Path())
    assert command.run(args) == 1
    graph = next(item for item in json.loads(capsys.readouterr().out) if item["subject"] == "graph")
    assert graph["verdict"] == "FAULT" and "no_such_module" in graph["text"]
    heard = {"verdict": "ok", "subject": "graph", "text": "no node runs", "cure": ""}
    (tmp_path / "listening.py").write_text(f"print({json.dumps(json.dumps([heard]))})")
    monkeypatch.setattr(command, "GRAPH", "listening")
    assert command.run(args) == 0
    assert heard in json.loads(capsys.readouterr().out)
    unusable = Finding("FAULT", "middleware", "none", "install one")
    monkeypatch.setattr(command, "look_at_installation", lambda: iter((unusable,)))
    assert command.run(args) == 1
    assert "graph" not in {item["subject"] for item in json.loads(capsys.readouterr().out)}
