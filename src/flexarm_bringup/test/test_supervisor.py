"""Children are started, watched and always taken down, also when the supervisor is killed."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from flexarm_bringup.installed import INDEX
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.supervisor import RESPAWNS, Ending, Supervisor
from flexarm_bringup.processes.surroundings import LIFE, PROFILES, of_life
from flexarm_model.process.start_watch import EXIT_STUCK

SLEEP = "import time; print('up', flush=True); time.sleep(300)"
DEAF = "import signal; [signal.signal(n, signal.SIG_IGN) for n in (signal.SIGINT, signal.SIGTERM)];" + SLEEP
POLITE = textwrap.dedent("""
    import signal, sys, time
    signal.signal(signal.SIGINT, lambda *_: sys.exit(0))
    print("up", flush=True)
    time.sleep(300)
""")
GRACE = ((signal.SIGINT, 0.3), (signal.SIGTERM, 0.3), (signal.SIGKILL, 10.0))


def python(program: str) -> Process:
    return Process("tests", program, f"p{abs(hash(program)) % 10**6}")


def start(folder: Path, *processes: Process) -> Supervisor:
    return Supervisor(processes, folder, command=lambda process: [sys.executable, "-c", process.executable])


def until(holds: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def is_up(supervisor: Supervisor, process: Process) -> bool:
    return "up" in supervisor.log(process.name).read_text()


def is_alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(")")[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_polite_child_ends_on_the_first_signal_and_a_deaf_one_on_the_last(tmp_path: Path) -> None:
    children = polite, dies, deaf = python(POLITE), python(SLEEP + "#"), python(DEAF)
    with start(tmp_path, *children) as supervisor:
        until(lambda: all(is_up(supervisor, child) for child in children))
        assert supervisor.failed() == ""
        codes = supervisor.stop(GRACE)
    assert codes[polite.name] == 0
    assert codes[dies.name] in (1, -signal.SIGINT)  # KeyboardInterrupt, as the interpreter reports it
    assert codes[deaf.name] == -signal.SIGKILL
    assert not any(is_alive(pid) for pid in supervisor.pids.values())


def test_the_end_of_an_essential_child_is_reported_with_its_last_words(tmp_path: Path) -> None:
    failing = python("import sys; print('trouble', file=sys.stderr); sys.exit(3)")
    with start(tmp_path, python(SLEEP), failing) as supervisor:
        until(lambda: failing.name in supervisor.exit_codes())
        assert supervisor.failed() == f"{failing.name} ended with 3: trouble"


def test_what_a_child_keeps_is_there_for_the_one_that_comes_back_and_not_for_the_next_run(
    tmp_path: Path,
) -> None:
    program = python(
        "import os; from flexarm_model.process.kept import Kept; kept = Kept('/flexarm/p');"
        "print('up', repr(kept.read()), flush=True); kept.keep('mine'); os.kill(os.getpid(), 9)"
    )
    for _ in range(2):
        with start(tmp_path, program) as supervisor:
            until(lambda: program.name in supervisor.exit_codes())
            assert supervisor.tend()[0].returns
            until(lambda: supervisor.log(program.name).read_text().count("up") == 2)
            assert supervisor.log(program.name).read_text().splitlines() == ["up ''", "up 'mine'"]


def test_two_graphs_that_log_into_one_folder_keep_apart_what_their_nodes_keep(tmp_path: Path) -> None:
    """The second took away what the first had switched off, and took over what it switched later."""
    program = python(
        "import os, sys; from flexarm_model.process.kept import Kept; kept = Kept('/flexarm/p');"
        "print('up', repr(kept.read()), flush=True); kept.keep(os.environ['RUN']); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program.executable]
    with Supervisor([program], tmp_path, {**os.environ, "RUN": "first"}, lambda _: command) as first:
        until(lambda: len(list(tmp_path.rglob("*.kept"))) == 1)
        with Supervisor([program], tmp_path, {**os.environ, "RUN": "second"}, lambda _: command):
            until(lambda: len(list(tmp_path.rglob("*.kept"))) == 2)
            assert {path.read_text() for path in tmp_path.rglob("*.kept")} == {"first", "second"}
            assert "up ''" in first.log(program.name).read_text()
    assert [path.name for path in tmp_path.iterdir()] == [f"{program.name}.log"]


def test_a_child_that_hung_while_it_started_is_told_as_that_and_comes_back(tmp_path: Path) -> None:
    hanging = python(f"print('the outermost frame'); raise SystemExit({EXIT_STUCK})")
    with start(tmp_path, hanging) as supervisor:
        until(lambda: hanging.name in supervisor.exit_codes())
        (ending,) = supervisor.tend()
        assert ending.returns
        assert ending.last_words == f"it hung while it started; {supervisor.log(hanging.name)} says where"


def test_the_end_of_another_child_is_no_failure(tmp_path: Path) -> None:
    minor = Process("tests", "raise SystemExit(1)", "minor", essential=False)
    with start(tmp_path, minor) as supervisor:
        assert supervisor.wait(60.0)
        assert supervisor.exit_codes() == {"minor": 1}
        assert supervisor.failed() == ""


def test_a_crashed_child_comes_back_until_it_has_crashed_too_often(tmp_path: Path) -> None:
    with start(tmp_path, python("print('trouble'); raise SystemExit(5)")) as supervisor:
        endings: list[Ending] = []
        while len(endings) <= RESPAWNS:
            until(lambda: bool(supervisor.exit_codes()))
            endings += supervisor.tend()
        assert supervisor.tend() == []
    assert [ending.returns for ending in endings] == [True] * RESPAWNS + [False]
    assert str(endings[-1]).endswith("trouble; not started again: 3 times in 30 s at most")
    assert str(endings[0]).endswith("ended with 5, started again: trouble")
    assert supervisor.log(endings[0].process.name).read_text() == "trouble\n" * (RESPAWNS + 1)


def test_the_end_of_a_child_is_told_once_and_without_looking(tmp_path: Path) -> None:
    told: list[str] = []
    with start(tmp_path, python(SLEEP)) as supervisor:
        (name,) = supervisor.pids
        with supervisor.telling(lambda process: told.append(process.name)):
            os.kill(supervisor.pids[name], signal.SIGKILL)
            until(lambda: told == [name])
            until(lambda: [ending.returns for ending in supervisor.tend()] == [True])
            os.kill(supervisor.pids[name], signal.SIGKILL)  # also of the one that came back
            until(lambda: told == [name, name])
        supervisor.tend()
        os.kill(supervisor.pids[name], signal.SIGKILL)
        until(lambda: bool(supervisor.exit_codes()))
    assert told == [name, name]


def test_the_end_of_a_child_is_told_while_the_rest_of_it_is_still_there(tmp_path: Path) -> None:
    """A process that is killed takes a while to give its memory back; one that sleeps stands for it."""
    lets_go = "import os, time; print('up', flush=True); os.close(0); time.sleep(300)"
    told: list[str] = []
    with start(tmp_path, python(lets_go)) as supervisor:
        (name,) = supervisor.pids
        with supervisor.telling(lambda process: told.append(process.name)):
            until(lambda: told == [name])
        assert supervisor.tend() == []


def test_a_child_that_cannot_be_started_again_is_told_and_the_others_go_on(tmp_path: Path) -> None:
    """Its package has been taken away, or is just being built."""
    tool, fails, stays = tmp_path / "tool", python("raise SystemExit(5)"), python(SLEEP)
    tool.symlink_to(sys.executable)

    def command(process: Process) -> list[str]:
        return [str(tool if process is fails else sys.executable), "-c", process.executable]

    with Supervisor((fails, stays), tmp_path / "log", command=command) as supervisor:
        until(lambda: fails.name in supervisor.exit_codes())
        tool.unlink()
        (ending,) = supervisor.tend()
        assert not ending.returns and supervisor.tend() == []
        assert str(ending).startswith(
            f"{fails.name} ended with 5: it said nothing; it cannot be started again"
        )
        assert str(tool) in str(ending)
        assert is_alive(supervisor.pids[stays.name])


@pytest.mark.parametrize("code", [0, 2, 3])
def test_a_child_that_would_end_again_stays_away(code: int, tmp_path: Path) -> None:
    with start(tmp_path, python(f"raise SystemExit({code})")) as supervisor:
        until(lambda: bool(supervisor.exit_codes()))
        (ending,) = supervisor.tend()
        assert (ending.code, ending.returns, ending.last_words) == (code, False, "it said nothing")


def test_children_see_this_machine_only_unless_told_otherwise(tmp_path: Path) -> None:
    name = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    assert Supervisor((), tmp_path, {}).environment[name] == "LOCALHOST"
    assert Supervisor((), tmp_path, {name: "SUBNET"}).environment[name] == "SUBNET"


@pytest.mark.parametrize(
    ("environment", "interfaces"),
    [
        ({}, ["127.0.0.1"]),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, ["127.0.0.1"]),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, []),
        ({"ROS_STATIC_PEERS": "10.0.0.2"}, []),
    ],
)
def test_children_listen_to_this_machine_only_unless_others_are_wanted(
    tmp_path: Path, environment: dict[str, str], interfaces: list[str]
) -> None:
    """A machine that named this one in its ROS_STATIC_PEERS found the rig."""
    tree = ElementTree.parse(Supervisor((), tmp_path, environment).environment[PROFILES])
    assert [item.text for item in tree.iterfind(".//{*}interfaceWhiteList/{*}address")] == interfaces
    assert tree.findtext(".//{*}useBuiltinTransports") == ("false" if interfaces else None)


def test_profiles_for_this_machine_alone_differ_in_their_transports_only(tmp_path: Path) -> None:
    texts = []
    for environment in ({}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}):
        tree = ElementTree.parse(Supervisor((), tmp_path, environment).environment[PROFILES])
        for parent in list(tree.iter()):
            for child in list(parent):
                if "ransport" in child.tag:
                    parent.remove(child)
        texts.append("".join(ElementTree.tostring(tree.getroot(), "unicode").split()))
    assert texts[0] == texts[1]


def test_children_keep_no_memory_of_messages_unless_the_user_has_profiles_of_his_own(tmp_path: Path) -> None:
    chosen = Supervisor((), tmp_path, {}).environment
    assert "DYNAMIC" in Path(chosen[PROFILES]).read_text() and chosen["RMW_FASTRTPS_USE_QOS_FROM_XML"] == "1"
    own = Supervisor((), tmp_path, {PROFILES: "mine.xml"}).environment
    assert own[PROFILES] == "mine.xml" and "RMW_FASTRTPS_USE_QOS_FROM_XML" not in own


def test_one_life_of_a_process_hears_at_other_ports_than_the_next(tmp_path: Path) -> None:
    """Of a domain's 250 ports 7400 + 250 d + offset + 2 k are those of participant k (RTPS ports)."""
    text = ElementTree.parse(Supervisor((), tmp_path, {}).environment[PROFILES]).findtext(".//{*}offsetd3")
    assert text is not None
    offsets = [int(text.replace("${FLEXARM_LIFE}", of_life(count)[LIFE])) for count in range(4)]
    first, second = ({offset + 2 * k for k in range(32)} for offset in offsets[:2])
    assert offsets == [11, 111, 11, 111] and not first & second and max(second) < 250


def test_no_child_outlives_a_supervisor_that_is_killed(tmp_path: Path) -> None:
    program = textwrap.dedent(f"""
        import sys, time
        from pathlib import Path
        from flexarm_bringup.processes.graph import Process
        from flexarm_bringup.processes.supervisor import Supervisor
        command = [sys.executable, "-c", {SLEEP!r}]
        names = [Process("tests", "x", name) for name in ("a", "b")]
        supervisor = Supervisor(names, Path({str(tmp_path)!r}), command=lambda process: command)
        print(*supervisor.pids.values(), flush=True)
        time.sleep(300)
    """)
    parent = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pids = [int(word) for word in parent.stdout.readline().split()]
    assert len(pids) == 2
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    until(lambda: not any(map(is_alive, pids)))


def test_nothing_keeps_running_when_one_child_cannot_be_started(tmp_path: Path) -> None:

    def command(process: Process) -> list[str]:
        if process.executable == "missing":
            raise FileNotFoundError("no such executable")
        return [sys.executable, "-c", "import os; print(os.getpid(), flush=True);" + SLEEP]

    with pytest.raises(FileNotFoundError):
        Supervisor([Process("t", "x", "first"), Process("t", "missing", "second")], tmp_path, command=command)
    started = [int(line) for line in (tmp_path / "first.log").read_text().split() if line.isdigit()]
    assert not any(map(is_alive, started))


def test_installed_executables_are_started_with_their_parameters(tmp_path: Path) -> None:
    (tmp_path / INDEX).mkdir(parents=True)
    (tmp_path / INDEX / "pkg").touch()
    executable = tmp_path / "lib" / "pkg" / "probe_node"
    executable.parent.mkdir(parents=True)
    executable.write_text(f"#!{sys.executable}\nimport sys\nprint(*sys.argv[1:])\n")
    executable.chmod(0o755)
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(tmp_path), "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    process = Process("pkg", "probe_node", "probe", {"rate": 200.0})
    with Supervisor([process], tmp_path / "log", environment) as supervisor:
        assert supervisor.wait(60.0)
    assert supervisor.log("probe").read_text() == "--ros-args -r __node:=probe -p rate:=200.0\n"
    assert "_ROS_WHEELS_BOOTSTRAP_COMPLETE" not in supervisor.environment


def test_what_is_not_installed_is_named(tmp_path: Path) -> None:
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(tmp_path)}
    with pytest.raises(FileNotFoundError, match=f"package nowhere is not installed in {tmp_path}"):
        Supervisor([Process("nowhere", "x", "x")], tmp_path / "log", environment)
