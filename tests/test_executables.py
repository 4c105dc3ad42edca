"""Console scripts claim the name of their node before they load anything that takes long."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from flexarm_bringup.demo_run.sessions import free_domains
from flexarm_bringup.parameters_command import NODES, parameters_of
from flexarm_model.process.enclave_keys import FILES
from flexarm_model.process.node_source import Source, node_parameters
from flexarm_model.process.single_instance import claim_name

SOURCE = Path(__file__).resolve().parents[1] / "src"
PACKAGES = ("flexarm_model", "flexarm_estimator", "flexarm_controller", "flexarm_bringup")
ENTRY = re.compile(r'"(\w+) = (\w+)\.executables:(\w+)"')
RUN = re.compile(r'def (\w+)\(\).*?run_executable\("([\w.]+)", \[(.*?)\]\)', re.DOTALL)
SECOND = """
import sys
from flexarm_controller.executables import guard_node
code = guard_node()
print(code, sorted({"numpy", "rclpy", "scipy", "casadi", "yaml"} & set(sys.modules)))
"""


@pytest.fixture(scope="module")
def domain() -> str:
    """Return a ROS domain that nobody else on this machine uses."""
    return str(next(free_domains()))


@pytest.mark.parametrize("package", PACKAGES)
def test_every_node_of_a_package_is_started_by_its_executables(package: str) -> None:
    entries = ENTRY.findall((SOURCE / package / "setup.py").read_text())
    code = (SOURCE / package / package / "executables.py").read_text()
    functions = {name: (module, nodes) for name, module, nodes in RUN.findall(code)}
    assert entries and {function for _, _, function in entries} == set(functions)
    for executable, own, function in entries:
        module, nodes = functions[function]
        path = SOURCE / own / f"{module.replace('.', '/')}.py"
        assert (executable, own) == (function, package) and nodes
        assert "\ndef main() -> int:" in path.read_text()


def test_a_second_node_is_refused_before_its_libraries_are_loaded(domain: str) -> None:
    with claim_name("/flexarm/left", domain) as held:
        command = [sys.executable, "-c", SECOND, "--ros-args", "-r", "__node:=left"]
        environment = {**os.environ, "ROS_DOMAIN_ID": domain}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        assert held.readable() and done.stdout == "3 []\n"
        assert f"guard_node: node /flexarm/left runs already in ROS domain {domain}" in done.stderr


@pytest.mark.parametrize("package", PACKAGES)
def test_every_node_says_what_it_does_and_which_parameters_it_has_instead_of_starting(package: str) -> None:
    for executable, _, _ in ENTRY.findall((SOURCE / package / "setup.py").read_text()):
        code = SECOND.replace("flexarm_controller", package).replace("guard_node", executable)
        command = [sys.executable, "-c", code, "--help"]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
        said = done.stdout
        assert said.startswith(f"usage: ros2 run {package} {executable} [--ros-args") and said.endswith(
            "0 []\n"
        )
        assert "--ros-args -p NAME:=VALUE" in said and re.search(r"^  \w+ +.*  \[.+\]$", said, re.MULTILINE)


@pytest.mark.parametrize("node", sorted(NODES))
def test_the_help_has_every_parameter_that_the_node_declares(node: str) -> None:
    found = node_parameters(Source(NODES[node].split(":")[0]))
    declared = {item.name: item for item in parameters_of(node)}
    assert {name: (item.default, item.metadata) for name, item in found.items()} == {
        name: (item.default, item.metadata) for name, item in declared.items()
    }


def test_nodes_in_one_process_have_the_parameters_of_both() -> None:
    both = node_parameters(Source("flexarm_bringup.processes.composed_node"))
    assert set(both) == {item.name for node in ("estimator", "controller") for item in parameters_of(node)}


def test_a_domain_that_is_none_is_refused_before_libraries_are_loaded() -> None:
    environment = {**os.environ, "ROS_DOMAIN_ID": "lab"}
    command = [sys.executable, "-c", SECOND]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "2 []\n"
    assert done.stderr == "guard_node: ROS_DOMAIN_ID: 'lab': expected a whole number, 0 to 232\n"


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"ROS_SECURITY_ENABLE": "true"}, "ROS_SECURITY_STRATEGY: ''"),
        ({"ROS_SECURITY_ENABLE": "1"}, "ROS_SECURITY_ENABLE: '1'"),
        ({"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}, "ROS_SECURITY_KEYSTORE: ''"),
    ],
)
def test_security_that_cannot_be_had_is_refused_before_libraries_are_loaded(
    asked: dict[str, str], told: str, domain: str
) -> None:
    environment = {**os.environ, "ROS_DOMAIN_ID": domain, **asked}
    command = [sys.executable, "-c", SECOND]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "2 []\n"
    assert done.stderr.startswith(f"guard_node: {told}: ") and done.stderr.count("\n") == 1


ENCLAVE = """
import sys
from flexarm_model.process.executable import run_executable
code = run_executable("spy", ["guard", "rig"])
"""


@pytest.mark.parametrize("name", ["guard", "left"])
def test_a_node_runs_in_the_enclave_of_its_name(name: str, tmp_path: Path, domain: str) -> None:
    (enclave := tmp_path / "enclaves" / "flexarm" / name).mkdir(parents=True)
    for file in FILES:
        (enclave / file).touch()
    (tmp_path / "spy.py").write_text("import sys\ndef main():\n    print(*sys.argv[-3:])\n    return 0\n")
    paths = os.pathsep.join((str(tmp_path), os.environ.get("PYTHONPATH", "")))
    asked = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}
    own = {"ROS_DOMAIN_ID": domain, "PYTHONPATH": paths, "ROS_SECURITY_KEYSTORE": str(tmp_path), **asked}
    command = [sys.executable, "-c", ENCLAVE, "--ros-args", "-r", f"guard:__node:={name}"]
    done = subprocess.run(command, env={**os.environ, **own}, capture_output=True, text=True)
    assert done.stdout == f"--ros-args --enclave /flexarm/{name}\n", done.stderr


HEARD = """
import os
from flexarm_model.process.executable import run_executable
print(run_executable("spy", ["spy"]))
"""


@pytest.mark.parametrize(("asked", "used"), [(None, "LOCALHOST"), ("", "LOCALHOST"), ("SUBNET", "SUBNET")])
def test_a_node_is_found_on_this_machine_alone_unless_the_user_says_else(
    asked: str | None, used: str, tmp_path: Path, domain: str
) -> None:
    name = "ROS_AUTOMATIC_DISCOVERY_RANGE"
    spy = f"import os\ndef main():\n    print(os.environ['{name}'])\n    return 0\n"
    (tmp_path / "spy.py").write_text(spy)
    paths = os.pathsep.join((str(tmp_path), os.environ.get("PYTHONPATH", "")))
    environment = {**os.environ, "ROS_DOMAIN_ID": domain, "PYTHONPATH": paths, name: asked or ""}
    if asked is None:
        del environment[name]
    done = subprocess.run([sys.executable, "-c", HEARD], env=environment, capture_output=True, text=True)
    assert done.stdout == f"{used}\n0\n", done.stderr


HEAVY = {"scipy", "scipy.spatial", "scipy.sparse", "scipy.optimize", "scipy.io", "scipy.stats", "filterpy"}
HEAVY |= {"osqp", "pinocchio", "matplotlib", "rosbags"}
LOADED = {
    "flexarm_model.model_node": set(),
    "flexarm_estimator.estimator_node": {"scipy"},
    "flexarm_controller.controller_node": {"scipy", "scipy.sparse", "osqp"},
    "flexarm_controller.guard_node": set(),
    "flexarm_bringup.rig_node": set(),
}


@pytest.mark.ros
@pytest.mark.parametrize("module", LOADED)
def test_a_node_starts_without_libraries_that_it_needs_now_and_then(module: str) -> None:
    pytest.importorskip("rclpy")
    code = f"import sys, {module}; print(*({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) <= LOADED[module]


REHEARSED = """
import os
import sys
from importlib import import_module
import rclpy
from flexarm_model.process import ahead
from flexarm_model.ros import node
module = sys.argv[0]
ahead.make_ahead(module, sys.argv)
assert len(ahead._MADE) == 1
node.run_node = lambda factory: rclpy.init(args=sys.argv) or factory() and len(ahead._MADE)
main = import_module(module)
main.run_node = node.run_node
print("left:", main.main(), flush=True)
os._exit(0)  # it has never run
"""


@pytest.mark.ros
@pytest.mark.parametrize("module", LOADED)
def test_a_node_asks_for_what_its_reserve_has_made(module: str) -> None:
    """Were one argument another, it would silently be made again, and a node that crashed be back late."""
    pytest.importorskip("flexarm_interfaces")
    from domain_coordinator import domain_id

    from flexarm_bringup.processes.graph import rig_graph, ros_arguments

    name = module.rpartition(".")[2].removesuffix("_node")
    settings: dict[str, dict[str, object]] = {
        "rig": {"seed": 3, "noise": 0.5},
        "guard": {"start": [0.2]},
        "model": {"start": [0.2]},
    }
    (row,) = (row for row in rig_graph(settings=settings) if row.name == name)
    with domain_id() as domain:
        own = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        code = f"import sys; sys.argv[0] = {module!r}\n{REHEARSED}"
        command = [sys.executable, "-c", code, *ros_arguments(row)]
        done = subprocess.run(
            command, env={**os.environ, **own}, capture_output=True, text=True, timeout=120.0, check=False
        )
    assert "left: 0" in done.stdout, done.stderr
