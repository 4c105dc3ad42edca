"""The bootstrap chooses an interpreter, says in one line what is missing, and repairs what is half done."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from flexarm_bringup.cli import COMMANDS, CUT_OFF

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture
def flexarm(bootstrap: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the bootstrap as a module that works on a small copy of a clone."""
    module = bootstrap
    monkeypatch.setattr(module, "ROOT", tmp_path)
    for variable in ("ROS_DISTRO", "FLEXARM_PYTHON", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    (tmp_path / "requirements.lock").write_text("one==1\n")
    for package in ("flexarm_interfaces", "flexarm_model"):
        (tmp_path / "src" / package / "test").mkdir(parents=True)
        (tmp_path / "src" / package / "package.xml").write_text("<package/>")
    return module


@pytest.fixture
def machine(flexarm: ModuleType, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Replace every command that is watched by a fake that is recorded; it makes an interpreter file."""
    done: list[str] = []

    def watch(title: str, argv: list[str], environ: dict[str, str], lock: int) -> None:
        if title.startswith("compiling"):
            return
        done.append(title.split()[0])
        if title.startswith("making"):
            binary = Path(argv[-1]) / "bin"
            binary.mkdir(parents=True)
            (binary / "python").symlink_to(sys.executable)
        elif title.startswith("building"):
            done.extend(argv[argv.index("--packages-select") + 1 : argv.index("--cmake-args")])
            (flexarm.STATE / "log").mkdir(exist_ok=True)
            for space in [word for word in argv if word.startswith("--install-base=")]:
                Path(space.partition("=")[2]).mkdir(parents=True, exist_ok=True)

    monkeypatch.setattr(flexarm, "watch", watch)
    monkeypatch.setattr(flexarm, "probe", lambda command, sourced: python(flexarm, "3.12"))
    monkeypatch.setattr(flexarm.shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(flexarm, "libc_version", lambda: "glibc 2.36")
    return done


def python(flexarm: ModuleType, version: str, **changes: object) -> object:
    major, minor = version.split(".")
    path = f"/usr/bin/python{version}"
    whole = flexarm.Python(path, (int(major), int(minor)), cpython=True, venv=True, headers=True, rclpy=False)
    return whole._replace(**changes)


def line_of(stopped: pytest.ExceptionInfo[Exception]) -> str:
    line = str(stopped.value)
    assert "\n" not in line
    assert stopped.value.code == 2
    return line


@pytest.mark.parametrize(
    ("versions", "chosen"),
    [
        (["3.11", "3.13", "3.12"], "3.12"),
        (["3.10", "3.11", "3.13"], "3.13"),
        (["3.9", "3.14", "3.10"], "3.10"),
    ],
)
def test_python_312_is_chosen_else_the_newest_that_has_wheels(
    flexarm: ModuleType, versions: list[str], chosen: str
) -> None:
    found = [None, *(python(flexarm, version) for version in versions)]
    assert flexarm.choose_python(found, compiler=True, sourced=False).name == chosen


def test_interpreter_without_venv_or_headers_gives_way_to_a_usable_one(flexarm: ModuleType) -> None:
    found = [
        python(flexarm, "3.12", venv=False),
        python(flexarm, "3.13", headers=False),
        python(flexarm, "3.10"),
    ]
    assert flexarm.choose_python(found, compiler=True, sourced=False).name == "3.10"


def test_other_implementations_are_passed_over(flexarm: ModuleType) -> None:
    found = [python(flexarm, "3.12", cpython=False), python(flexarm, "3.11")]
    assert flexarm.choose_python(found, compiler=True, sourced=False).name == "3.11"


def test_one_line_names_everything_that_is_missing(flexarm: ModuleType) -> None:
    with pytest.raises(flexarm.Stop) as stopped:
        flexarm.choose_python(
            [python(flexarm, "3.11", venv=False, headers=False)], compiler=False, sourced=False
        )
    assert line_of(stopped).endswith("sudo apt install g++ python3.11-venv python3.11-dev")


def test_missing_compiler_is_named_alone(flexarm: ModuleType) -> None:
    with pytest.raises(flexarm.Stop) as stopped:
        flexarm.choose_python([python(flexarm, "3.12")], compiler=False, sourced=False)
    assert line_of(stopped).endswith("sudo apt install g++")


def test_too_old_python_is_told_the_range(flexarm: ModuleType) -> None:
    with pytest.raises(flexarm.Stop) as stopped:
        flexarm.choose_python([python(flexarm, "3.9")], compiler=True, sourced=False)
    assert "3.10 to 3.13" in line_of(stopped)


def test_sourced_jazzy_needs_an_interpreter_that_imports_its_rclpy(flexarm: ModuleType) -> None:
    found = [python(flexarm, "3.12"), python(flexarm, "3.12", path="/ros/python", rclpy=True)]
    assert flexarm.choose_python(found, compiler=True, sourced=True).path == "/ros/python"
    with pytest.raises(flexarm.Stop, match="rclpy"):
        flexarm.choose_python(found[:1], compiler=True, sourced=True)


def test_shim_that_does_not_run_is_no_interpreter(flexarm: ModuleType, tmp_path: Path) -> None:
    shim = tmp_path / "python3.12"
    shim.write_text("#!/bin/sh\necho 'command not found' >&2\nexit 127\n")
    shim.chmod(0o755)
    assert flexarm.probe(str(shim), sourced=False) is None
    assert flexarm.probe(str(tmp_path / "absent"), sourced=False) is None


def test_probe_describes_the_interpreter_that_runs_this_test(flexarm: ModuleType) -> None:
    seen = flexarm.probe(sys.executable, sourced=False)
    assert seen.version == sys.version_info[:2]
    assert seen.cpython and seen.venv


@pytest.mark.parametrize(
    ("system", "machine_name", "libc"),
    [
        ("Darwin", "arm64", ""),
        ("Linux", "aarch64", "glibc 2.36"),
        ("Linux", "x86_64", ""),  # musl
        ("Linux", "x86_64", "glibc 2.27"),
    ],
)
def test_platform_without_wheels_is_refused_in_one_line(
    flexarm: ModuleType, system: str, machine_name: str, libc: str
) -> None:
    with pytest.raises(flexarm.Stop) as stopped:
        flexarm.check_platform(system, machine_name, libc)
    assert "x86-64" in line_of(stopped)


@pytest.mark.parametrize("libc", ["glibc 2.28", "glibc 2.36", "glibc 3.0"])
def test_platform_with_wheels_is_accepted(flexarm: ModuleType, libc: str) -> None:
    flexarm.check_platform("Linux", "x86_64", libc)


def test_sourced_jazzy_is_seen_and_another_distro_refused(flexarm: ModuleType) -> None:
    assert not flexarm.sourced_jazzy({})
    assert not flexarm.sourced_jazzy({"ROS_DISTRO": "humble"})  # named by a container, sourced by nobody
    assert flexarm.sourced_jazzy({"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": "/opt/ros/jazzy"})
    with pytest.raises(flexarm.Stop) as stopped:
        flexarm.sourced_jazzy({"ROS_DISTRO": "humble", "AMENT_PREFIX_PATH": "/opt/ros/humble"})
    assert "humble" in line_of(stopped)


def test_nothing_of_another_ros_or_python_reaches_the_wheels(
    flexarm: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LD_LIBRARY_PATH", "/opt/ros/humble/lib:/opt/compiler/lib")
    monkeypatch.setenv("PYTHONPATH", "/somewhere")
    monkeypatch.setenv("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "1")
    left = flexarm.inherited(sourced=False)
    assert left["LD_LIBRARY_PATH"] == "/opt/compiler/lib"
    assert "PYTHONPATH" not in left
    assert "_ROS_WHEELS_BOOTSTRAP_COMPLETE" not in left


def test_second_run_has_nothing_to_do(flexarm: ModuleType, machine: list[str]) -> None:
    first = flexarm.prepare()
    assert machine == ["making", "installing", "building", "flexarm_interfaces", "flexarm_model"]
    machine.clear()
    assert flexarm.prepare() == first
    assert machine == []


def test_only_the_package_whose_files_changed_is_built_again(flexarm: ModuleType, machine: list[str]) -> None:
    flexarm.prepare()
    machine.clear()
    (flexarm.ROOT / "src/flexarm_model/new.py").write_text("x = 1\n")
    (flexarm.ROOT / "src/flexarm_interfaces/test/test_x.py").write_text("")
    flexarm.prepare()
    assert machine == ["building", "flexarm_model"]


def test_changed_lock_makes_another_environment(flexarm: ModuleType, machine: list[str]) -> None:
    first = flexarm.prepare()
    (flexarm.ROOT / "requirements.lock").write_text("one==2\n")
    assert flexarm.prepare().env != first.env


def test_python_is_compiled_where_it_is_installed_and_not_by_every_node(
    flexarm: ModuleType, machine: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With PYTHONDONTWRITEBYTECODE, as containers set it, every process compiled flexarm anew."""
    watched, compiled = flexarm.watch, []

    def watch(title: str, argv: list[str], environ: dict[str, str], lock: int) -> None:
        if "compileall" in argv[2]:
            compiled.extend(argv[3:])
        watched(title, argv, environ, lock)

    monkeypatch.setattr(flexarm, "watch", watch)
    place = flexarm.prepare()
    spaces = [place.install / name for name in ("flexarm_interfaces", "flexarm_model")]
    assert compiled == [str(folder) for folder in (place.env / "lib", *spaces)]


def test_what_this_python_cannot_compile_stops_no_installation(
    bootstrap: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Packages bring files for other Pythons; nor does it compile their tests."""
    monkeypatch.setattr(bootstrap, "STATE", tmp_path / "state")
    folder = tmp_path / "tests" / "lib"  # where the clone lies does not matter
    (folder / "tests").mkdir(parents=True)
    (folder / "newer.py").write_text("match = \n")
    (folder / "sound.py").write_text("x = 1\n")
    (folder / "tests" / "of_others.py").write_text("x = 1\n")
    place = SimpleNamespace(python=sys.executable)
    bootstrap.compile_python(place, [folder], "compiling", os.open(os.devnull, os.O_RDONLY))
    assert [path.name.partition(".")[0] for path in folder.rglob("*.pyc")] == ["sound"]


@pytest.mark.parametrize("interrupted", ["making", "installing", "building"])
def test_run_after_an_interrupted_one_repairs_it(
    flexarm: ModuleType, machine: list[str], monkeypatch: pytest.MonkeyPatch, interrupted: str
) -> None:
    whole = flexarm.watch

    def cut(title: str, *rest: object) -> None:
        whole(title, *rest)
        if title.startswith(interrupted):
            raise KeyboardInterrupt

    monkeypatch.setattr(flexarm, "watch", cut)
    with pytest.raises(KeyboardInterrupt):
        flexarm.prepare()
    monkeypatch.setattr(flexarm, "watch", whole)
    machine.clear()
    flexarm.prepare()
    redone = ["building", "flexarm_interfaces", "flexarm_model"]
    assert machine == (redone if interrupted == "building" else ["making", "installing", *redone])
    machine.clear()
    flexarm.prepare()
    assert machine == []


@pytest.mark.parametrize(
    ("arguments", "brings"),
    [([], True), (["--json", "x"], True), (["engines", "one"], True), (["mpc"], True), (["one"], False)],
)
def test_other_engines_are_brought_once_and_only_when_they_are_measured(
    flexarm: ModuleType,
    machine: list[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    brings: bool,
) -> None:
    (flexarm.ROOT / "requirements.bench.lock").write_text("engine==1\n")
    (flexarm.ROOT / "benchmarks").mkdir()
    for name in ("one", "engines", "mpc"):
        (flexarm.ROOT / "benchmarks" / f"bench_{name}.py").touch()
    monkeypatch.setattr(flexarm, "forward", lambda place, rest: len(rest))
    place = flexarm.prepare()
    machine.clear()
    assert flexarm.run_bench(place, arguments) == 1 + len(arguments)
    assert flexarm.run_bench(place, arguments) == 1 + len(arguments)
    assert machine == ["installing"] * brings


def test_a_benchmark_that_does_not_exist_brings_nothing(
    flexarm: ModuleType, machine: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flexarm, "forward", lambda place, arguments: 2)
    place = flexarm.prepare()
    (flexarm.ROOT / "requirements.bench.lock").write_text("engine==1\n")
    machine.clear()
    assert flexarm.run_bench(place, ["engine"]) == 2
    assert machine == []


def test_a_folder_without_what_compares_with_other_engines_brings_none(
    flexarm: ModuleType, machine: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (flexarm.ROOT / "benchmarks").mkdir()
    (flexarm.ROOT / "benchmarks" / "bench_engines.py").touch()
    (flexarm.ROOT / "requirements.bench.lock").write_text("engine==1\n")
    other = tmp_path / "other"
    other.mkdir()
    monkeypatch.setattr(flexarm, "forward", lambda place, rest: 2)
    place = flexarm.prepare()
    machine.clear()
    for arguments in (["--folder", str(other)], [f"--folder={other}"]):
        assert flexarm.run_bench(place, arguments) == 2
    assert machine == []
    (other / "bench_engines.py").touch()
    flexarm.run_bench(place, ["--folder", str(other)])
    assert machine == ["installing"]


@pytest.mark.parametrize("arguments", [["--help"], ["-h", "--ros-args", "-p", "a:=b"]])
def test_a_node_that_is_asked_for_help_is_not_started(
    flexarm: ModuleType,
    machine: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
) -> None:
    place, started = flexarm.prepare(), []
    folder = place.install / "flexarm_model" / "lib" / "flexarm_model"
    folder.mkdir(parents=True)
    (folder / "model_node").touch()
    monkeypatch.setattr(flexarm, "replace_by", lambda argv, environ: started.append(argv) or 0)
    assert flexarm.run_executable(place, ["flexarm_model", "model_node", *arguments]) == 0
    assert "usage: ./flexarm run flexarm_model model_node" in capsys.readouterr().out and not started
    assert flexarm.run_executable(place, ["--help"]) == 0
    assert "  flexarm_model model_node\n" in capsys.readouterr().out
    assert flexarm.run_executable(place, ["flexarm_model", "model_node", "--ros-args", "--help"]) == 0
    assert len(started) == 1  # that is for ROS to say


def test_a_misspelt_command_of_this_file_is_answered_with_the_right_one(
    flexarm: ModuleType, machine: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for wrong, right in (("buidl", "build"), ("tests", "test"), ("cleen", "clean"), ("shel", "shell")):
        with pytest.raises(flexarm.Stop, match=f"no command '{wrong}': {right}\\? "):
            flexarm.main([wrong])
    assert machine == []
    forwarded: list[str] = []
    monkeypatch.setattr(flexarm, "forward", lambda place, arguments: forwarded.extend(arguments) or 0)
    monkeypatch.setattr(flexarm, "run_bench", lambda place, arguments: 0)
    for command in COMMANDS:
        assert flexarm.main([command]) == 0
    assert forwarded == [command for command in COMMANDS if command != "bench"]


@pytest.mark.parametrize(("command", "builds"), [("stop", False), ("arm", True)])
def test_a_stop_does_not_wait_for_a_build(
    flexarm: ModuleType,
    machine: list[str],
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    builds: bool,
) -> None:
    """What was built before the last edit stops the arm as well; an interrupted build is repaired first."""
    monkeypatch.setattr(flexarm, "forward", lambda place, arguments: 0)
    flexarm.prepare()
    (flexarm.ROOT / "src" / "flexarm_model" / "package.xml").write_text("<package><!-- edited --></package>")
    machine.clear()
    assert flexarm.main([command]) == 0
    assert ("building" in machine) == builds
    (flexarm.prepare().workspace / "stamps" / "flexarm_interfaces").unlink()
    machine.clear()
    assert flexarm.main([command]) == 0
    assert "building" in machine


def test_a_reader_that_has_seen_enough_of_the_help_ends_it_without_a_word() -> None:
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    for arguments in ([], ["--help"]):
        command = [sys.executable, str(ROOT / "flexarm"), *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        with subprocess.Popen(command, env=buffered, **pipes) as process:  # type: ignore[call-overload]
            assert process.stdout is not None and process.stderr is not None
            process.stdout.readline()
            process.stdout.close()  # as "| head -1" does
            assert process.stderr.read() == b""
        assert process.returncode in (0, CUT_OFF)


@pytest.mark.parametrize("command", ["build", "env", "clean"])
def test_what_takes_no_arguments_does_nothing_with_some(
    flexarm: ModuleType, command: str, machine: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    flexarm.STATE.mkdir()
    with pytest.raises(flexarm.Stop, match=f"{command} takes no arguments, not everything"):
        flexarm.main([command, "everything"])
    assert flexarm.main([command, "--help"]) == 0
    assert "usage: ./flexarm" in capsys.readouterr().out
    assert flexarm.STATE.exists() and machine == []


def test_benchmarks_run_without_the_other_engines_when_those_cannot_be_had(
    flexarm: ModuleType,
    machine: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (flexarm.ROOT / "requirements.bench.lock").write_text("engine==1\n")
    (flexarm.ROOT / "benchmarks").mkdir()
    (flexarm.ROOT / "benchmarks" / "bench_engines.py").touch()
    place = flexarm.prepare()

    def fail(*_: object) -> None:
        raise flexarm.Stop("no network")

    monkeypatch.setattr(flexarm, "forward", lambda place, rest: 0)
    monkeypatch.setattr(flexarm, "watch", fail)
    assert flexarm.run_bench(place, []) == 0
    assert "no other engines and solvers: no network" in capsys.readouterr().err


def test_environment_whose_interpreter_is_gone_is_made_again(flexarm: ModuleType, machine: list[str]) -> None:
    place = flexarm.prepare()
    Path(place.python).unlink()
    machine.clear()
    flexarm.prepare()
    assert machine == ["making", "installing"]


def test_failed_command_shows_its_end_and_where_the_rest_is(
    flexarm: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    flexarm.STATE.mkdir()
    code = "print('first'); print('the reason'); raise SystemExit(3)"
    with flexarm.only_one() as lock, pytest.raises(flexarm.Stop, match="installing things failed") as stopped:
        flexarm.watch("installing things", [sys.executable, "-c", code], {}, lock)
    assert stopped.value.code == 1
    assert "the reason" in capsys.readouterr().err
    assert (flexarm.STATE / "log/installing.log").read_text().startswith("first")


def test_progress_is_a_line_at_the_start_and_one_now_and_then(
    flexarm: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flexarm, "PIPE_PERIOD", 0.05)
    monkeypatch.setattr(flexarm.sys, "stderr", io.StringIO())
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(0.5)"], text=True) as child:
        flexarm.tick(child, lambda: "at work")
    assert flexarm.sys.stderr.getvalue().count("at work\n") >= 2


def test_second_run_waits_for_the_lock_of_the_first(flexarm: ModuleType) -> None:
    attempt = "import fcntl, sys; fcntl.flock(open(sys.argv[1]), fcntl.LOCK_EX | fcntl.LOCK_NB)"
    argv = [sys.executable, "-c", attempt, str(flexarm.STATE / "lock")]
    with flexarm.only_one():
        assert subprocess.run(argv, capture_output=True).returncode != 0
    assert subprocess.run(argv, capture_output=True).returncode == 0


def test_a_middleware_that_the_wheels_do_not_have_is_not_asked_for(
    flexarm: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Whoever has another one in his .bashrc had every node and command end with 102."""
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    told = [
        flexarm.environment(flexarm.Place(tmp_path, tmp_path, is_sourced), [])["RMW_IMPLEMENTATION"]
        for is_sourced in (False, True)
    ]
    assert told == ["rmw_fastrtps_cpp", "rmw_cyclonedds_cpp"]


def test_where_somebody_else_has_installed_it_logs_go_where_ros_puts_them(
    flexarm: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_LOG_DIR", raising=False)
    place = flexarm.place_for("3.12", False)
    flexarm.STATE.mkdir()
    assert flexarm.environment(place, [])["ROS_LOG_DIR"] == str(flexarm.STATE / "log")
    monkeypatch.setattr(flexarm.os, "access", lambda path, mode: False)
    assert "ROS_LOG_DIR" not in flexarm.environment(place, [])


def test_a_place_that_cannot_be_written_is_told_in_one_line(tmp_path: Path) -> None:
    script, in_the_way = tmp_path / "flexarm", tmp_path / ".flexarm"
    script.write_bytes((ROOT / "flexarm").read_bytes())
    in_the_way.write_text("not a folder")
    done = subprocess.run([sys.executable, script, "clean"], capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr == f"flexarm: {in_the_way}: File exists\n"


def test_exported_lines_survive_a_shell(flexarm: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONHOME", "/old")
    lines = flexarm.export_lines({"FLEXARM_TEST": "a b'c$d"})
    script = "\n".join([*lines, 'printf "%s|%s" "$FLEXARM_TEST" "$PYTHONHOME"'])
    done = subprocess.run(["sh", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "a b'c$d|"


@pytest.mark.parametrize(
    "name", ["PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_DRY_RUN", "PIP_PYTHON", "PIP_USER"]
)
def test_settings_of_a_user_s_pip_do_not_lead_it_elsewhere(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Nothing was in the environment then, and it was called complete."""
    seen: list[dict[str, str]] = []
    monkeypatch.setattr(bootstrap, "watch", lambda title, argv, environ, lock: seen.append(environ))
    place = SimpleNamespace(python=sys.executable, env=Path("env"))
    bootstrap.pip_install(place, Path("some.lock"), "installing", {name: "1", "HOME": "/home/u"}, 0)
    assert seen[0].get(name) == ("0" if name == "PIP_USER" else None)
    assert seen[0]["HOME"] == "/home/u"


def test_who_waited_for_a_lock_that_was_removed_takes_the_new_one(bootstrap: ModuleType) -> None:
    """After a clean it held the old one, and the next run installed beside it."""
    entered: list[str] = []

    def wait() -> None:
        with bootstrap.only_one() as descriptor:
            entered.append("same" if bootstrap.is_this(descriptor, bootstrap.STATE / "lock") else "another")

    with bootstrap.only_one():
        waiting = threading.Thread(target=wait)
        waiting.start()
        waiting.join(0.5)
        assert waiting.is_alive()
        shutil.rmtree(bootstrap.STATE)
    waiting.join(10.0)
    assert entered == ["same"]


def test_what_lies_on_a_larger_disk_is_removed_there(bootstrap: ModuleType, tmp_path: Path) -> None:
    elsewhere = tmp_path / "disk"
    (elsewhere / "env").mkdir(parents=True)
    bootstrap.STATE.symlink_to(elsewhere)
    assert bootstrap.clean() == 0
    assert not elsewhere.exists() and not bootstrap.STATE.is_symlink()
