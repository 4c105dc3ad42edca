"""The life of a node: parameters checked at start, readiness, a clean end on a signal."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest

from flexarm_model.process import start_watch

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy")

PATIENCE = 60.0  # s for what takes a second where nothing else runs
PROGRAM = textwrap.dedent("""
    import sys
    from dataclasses import dataclass
    from flexarm_model.ros.declared_node import declare_config
    from flexarm_model.ros.node import ReadyFlag, run_node
    from flexarm_model.settings.parameters import parameter
    from rclpy.node import Node

    @dataclass(frozen=True)
    class Config:
        rate: float = parameter(200.0, "Control rate", "Hz", 1.0, 1000.0)
        modes: int = parameter(3, "Modes in the model", minimum=0, maximum=10)
        weights: tuple[float, ...] = parameter((1.0, 2.0), "Weights", minimum=0.0)
        sensors_off: tuple[str, ...] = parameter((), "Sensors not to be used")
        source: str = parameter("rig", "Where from", choices=("rig", "bag"))
        lockstep: bool = parameter(False, "Wait for ticks")

    class Probe(Node):
        def __init__(self):
            super().__init__("probe")
            print(declare_config(self, Config), flush=True)
            print(self.describe_parameter("rate").description, flush=True)
            print("type", self.describe_parameter("sensors_off").type, flush=True)
            self.ready = ReadyFlag(self, {"nothing": lambda: True})
            self.create_timer(0.02, self.on_timer)

        def on_timer(self):
            if self.ready.is_ready:
                print("ready", flush=True)

        def stop(self):
            print("stopped", flush=True)

    sys.exit(run_node(Probe))
""")


def start(*overrides: str) -> subprocess.Popen[str]:
    arguments = [item for override in overrides for item in ("-p", override)]
    command = [sys.executable, "-c", PROGRAM, "--ros-args", *arguments]
    environment = {key: value for key, value in os.environ.items() if key != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    return subprocess.Popen(
        command,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_node_becomes_ready_and_ends_in_order_on_a_signal(number: int) -> None:
    process = start("rate:=3", "weights:=[3, 4]", "source:=bag", "lockstep:=true")
    assert process.stdout is not None
    lines = []
    deadline = time.monotonic() + PATIENCE
    while "ready\n" not in lines and time.monotonic() < deadline:
        lines.append(process.stdout.readline())
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err
    assert out.splitlines()[-1] == "stopped"
    expected = "Config(rate=3.0, modes=3, weights=(3.0, 4.0), sensors_off=(), source='bag', lockstep=True)"
    assert lines[:3] == [expected + "\n", "Control rate [Hz]\n", "type 9\n"]  # of an empty list: of texts


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_who_is_asked_again_and_again_ends_as_if_asked_once(number: int) -> None:
    """As ``ros2 launch`` does without a terminal: its process group has had the signal already."""
    process = start()
    assert process.stdout is not None
    while process.stdout.readline() != "ready\n":
        assert process.poll() is None
    while process.poll() is None:
        process.send_signal(number)
        time.sleep(5e-4)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out.splitlines()[-1]) == (0, "stopped"), err


def test_a_second_node_of_the_same_name_ends_at_once_and_a_killed_one_leaves_its_name_free() -> None:
    first = start()
    assert first.stdout is not None
    while first.stdout.readline() != "ready\n":
        assert first.poll() is None
    second = start()
    _, err = second.communicate(timeout=PATIENCE)
    assert second.returncode == 3 and len(err.splitlines()) == 1
    assert "node /probe runs already in ROS domain" in err and f"(process {first.pid})" in err
    first.kill()
    first.communicate()
    third = start()
    assert third.stdout is not None
    while third.stdout.readline() != "ready\n":
        assert third.poll() is None
    third.terminate()
    assert third.wait(PATIENCE) == 0


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        ("rate:=.nan", "rate: nan is not a finite number"),
        ("rate:=-1.0", "rate: -1.0 is not"),
        ("rate:=fast", "rate: 'fast' is not a number"),
        ("rate:=true", "rate: True is not a number"),
        ("modes:=3.5", "modes: 3.5 is not a whole number"),
        ("modes:=11", "modes: 11 is not"),
        ("weights:=1.0", "weights: 1.0 is not a list of numbers"),
        ("weights:=[1.0, -2.0]", "weights: -2.0 is not"),
        ("sensors_off:=camera", "sensors_off: 'camera' is not a list of texts"),
        ("source:=file", "source: 'file' is not one of rig, bag"),
        ("raet:=5.0", "raet: unknown parameter of probe; allowed: lockstep, modes, rate"),
        ("use_sim_timer:=true", "use_sim_timer: unknown parameter of probe; allowed: lockstep, "),
        (
            "start_type_description_servicee:=true",
            "start_type_description_servicee: unknown parameter of probe",
        ),
        ("qos_overrides.nonsense:=3", "qos_overrides.nonsense: unknown parameter of probe"),
    ],
)
def test_a_wrong_parameter_ends_the_node_with_one_line_that_names_it(override: str, reason: str) -> None:
    process = start(override)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert len(err.splitlines()) == 1
    assert reason in err


def test_a_malformed_parameter_file_ends_the_node(tmp_path: pytest.TempPathFactory) -> None:
    path = f"{tmp_path}/bad.yaml"
    with open(path, "w") as file:
        file.write("probe: [not, parameters\n")
    command = [sys.executable, "-c", PROGRAM, "--ros-args", "--params-file", path]
    environment = {key: value for key, value in os.environ.items() if key != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    result = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert result.returncode == 2
    assert "bad.yaml" in result.stderr.splitlines()[-1]


COMPOSED = textwrap.dedent("""
    import sys
    from flexarm_model.ros.node import run_node
    from rclpy.node import Node

    class Beside(Node):
        is_finished = False

        def __init__(self):
            super().__init__("beside")
            self.create_timer(0.02, self.finish)

        def finish(self):
            self.is_finished = True

        def stop(self):
            print("beside stopped", flush=True)

    class Main(Node):
        def __init__(self):
            super().__init__("main")
            self.companions = (Beside(),)

        def stop(self):
            print("main stopped", flush=True)

    sys.exit(run_node(Main))
""")


def test_a_process_of_two_nodes_ends_when_either_of_them_does() -> None:
    done = subprocess.run(
        [sys.executable, "-c", COMPOSED], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert (done.returncode, done.stdout) == (0, "main stopped\nbeside stopped\n"), done.stderr


def test_a_node_that_hangs_while_it_is_made_ends_with_its_stacks() -> None:
    hanging = PROGRAM.replace('super().__init__("probe")', "ctypes.PyDLL(None).sleep(60)")
    watched = "import ctypes\nfrom flexarm_model.process import start_watch\nstart_watch.PATIENCE = 2.0\n"
    command = [sys.executable, "-c", watched + hanging]
    environment = {key: value for key, value in os.environ.items() if key != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=50, check=False)
    assert ended.returncode == start_watch.EXIT_STUCK
    assert "in __init__" in ended.stderr
