"""Who asks for security gets it or a refusal that says what is set, what it means and what to do."""

from pathlib import Path

import pytest

from flexarm_model.process.enclave_keys import FILES
from flexarm_model.process.security import (
    SecurityError,
    check_security,
    check_unsecured,
    is_security_asked_for,
    told_of_security,
    with_enclave,
)

ON = {"ROS_SECURITY_ENABLE": "true"}
ENFORCED = {**ON, "ROS_SECURITY_STRATEGY": "Enforce"}
OFF = "; {}, or export ROS_SECURITY_ENABLE=false to run without security"
LINE = ["guard_node", "--ros-args", "--enclave", "/flexarm/guard"]


@pytest.mark.parametrize("value", ["", "false", "False", "FALSE"])
def test_without_security_asked_for_nothing_is_checked_and_no_enclave_given(value: str) -> None:
    environment = {"ROS_SECURITY_ENABLE": value, "ROS_SECURITY_STRATEGY": "Permissive"}
    assert not is_security_asked_for(environment)
    check_security([], environment)
    check_unsecured(environment)
    assert with_enclave(["x"], "/flexarm/guard", environment) == ["x"]


@pytest.mark.parametrize("value", ["True", "TRUE", "1", "yes", "on", " true"])
def test_a_yes_that_ros_takes_for_no_is_refused(value: str) -> None:
    with pytest.raises(SecurityError) as refusal:
        check_security(LINE, {**ENFORCED, "ROS_SECURITY_ENABLE": value})
    means = f"ROS_SECURITY_ENABLE: '{value}': ROS takes it for no and runs unsecured"
    assert str(refusal.value) == means + OFF.format("export ROS_SECURITY_ENABLE=true")


@pytest.mark.parametrize("strategy", [None, "", "Permissive", "enforce", "ENFORCE", "Enforce "])
def test_every_strategy_but_one_is_refused_also_with_keys(strategy: str | None, tmp_path: Path) -> None:
    give_keys(tmp_path, "flexarm/guard")
    environment = {**ON, "ROS_SECURITY_KEYSTORE": str(tmp_path)}
    environment |= {} if strategy is None else {"ROS_SECURITY_STRATEGY": strategy}
    with pytest.raises(SecurityError) as refusal:
        check_security(LINE, environment)
    means = "with ROS_SECURITY_ENABLE=true, ROS runs unsecured where keys are missing"
    cure = OFF.format("export ROS_SECURITY_STRATEGY=Enforce")
    assert str(refusal.value) == f"ROS_SECURITY_STRATEGY: '{strategy or ''}': {means}{cure}"
    check_security(LINE, {**environment, "ROS_SECURITY_STRATEGY": "Enforce"})


def test_without_a_keystore_or_an_enclave_in_it_security_is_refused(tmp_path: Path) -> None:
    for store in (None, "", str(tmp_path / "missing")):
        given = ENFORCED | ({} if store is None else {"ROS_SECURITY_KEYSTORE": store})
        with pytest.raises(SecurityError, match="ROS_SECURITY_KEYSTORE: '.*': no folder of keys"):
            check_security(LINE, given)
    keyed = {**ENFORCED, "ROS_SECURITY_KEYSTORE": str(tmp_path)}
    with pytest.raises(SecurityError, match=f"create_enclave {tmp_path} /flexarm/guard, then create_perm"):
        check_security(LINE, keyed)
    give_keys(tmp_path, "lab/left")
    check_security(LINE, {**keyed, "ROS_SECURITY_ENCLAVE_OVERRIDE": "/lab/left"})
    check_security([*LINE, "-e", "/lab/left"], keyed)  # rcl takes the last one
    give_keys(tmp_path, "")
    check_security(["guard_node"], keyed)  # of no enclave: that of the keystore itself


@pytest.mark.parametrize("files", [FILES, FILES[2:3], FILES[-1:]])
def test_an_enclave_without_all_of_its_files_is_refused_by_their_names(
    files: tuple[str, ...], tmp_path: Path
) -> None:
    """With an empty folder the middleware refused, and the advice was to install its libraries."""
    enclave = give_keys(tmp_path, "flexarm/guard")
    for name in files:
        (enclave / name).unlink()
    with pytest.raises(SecurityError) as refusal:
        check_security(LINE, {**ENFORCED, "ROS_SECURITY_KEYSTORE": str(tmp_path)})
    assert f"'{tmp_path}': no {', '.join(files)} for the enclave /flexarm/guard" in str(refusal.value)
    assert f"create_enclave {tmp_path} /flexarm/guard" in str(refusal.value)


def give_keys(store: Path, enclave: str) -> Path:
    """Make the folder of an enclave with all that it must hold; nothing is in its files."""
    folder = store / "enclaves" / enclave
    folder.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        (folder / name).touch()
    return folder


@pytest.mark.parametrize(
    "line",
    [["x"], ["x", "--ros-args", "-p", "a:=1"], ["x", "--ros-args", "-p", "a:=1", "--", "-e", "/y"], []],
)
def test_a_process_goes_into_its_enclave_unless_its_command_line_names_one(line: list[str]) -> None:
    assert with_enclave(line, "/flexarm/guard", ENFORCED) == [*line, *LINE[1:]]
    for named in ("-e", "--enclave"):
        own = [*line, "--ros-args", named, "/lab/left"]
        assert with_enclave(own, "/flexarm/guard", ENFORCED) == own


@pytest.mark.ros
def test_rcl_takes_the_last_enclave_of_a_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rclpy = pytest.importorskip("rclpy")
    from rclpy.context import Context
    from rclpy.impl.implementation_singleton import rclpy_implementation

    for name, value in {**ENFORCED, "ROS_SECURITY_KEYSTORE": str(tmp_path)}.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(rclpy_implementation.RCLError, match="enclaves/lab/left' does not exist"):
        rclpy.init(args=[*LINE, "--ros-args", "-e", "/lab/left"], context=Context(), domain_id=77)


def test_domains_of_their_own_have_no_keys() -> None:
    with pytest.raises(
        SecurityError, match="^ROS_SECURITY_ENABLE: 'true': .*; export ROS_SECURITY_ENABLE=false"
    ):
        check_unsecured({**ENFORCED, "ROS_SECURITY_KEYSTORE": "/"})


def test_what_rcl_says_of_security_is_told_in_one_line_with_what_to_do() -> None:
    said = "This DDS doesn't have the security libraries\nPlease compile"
    assert told_of_security(said, {}) == said.replace("\n", " ")
    assert told_of_security("no such\nparameter", ENFORCED) == "no such parameter"
    assert "\n" not in told_of_security(said, ENFORCED)
    assert told_of_security(said, ENFORCED).endswith(OFF.format("install a DDS that has it"))
