"""What a command line says of a node's name is what rcl makes of it."""

import pytest

from flexarm_model.process.ros_arguments import asks_help, domain, node_name, values_of

NAMES = [
    ([], "/flexarm/guard"),
    (["--ros-args", "-r", "__node:=left"], "/flexarm/left"),
    (["--ros-args", "-r", "__name:=left"], "/flexarm/left"),
    (["--ros-args", "-r", "__node:=left", "-r", "__node:=right"], "/flexarm/left"),
    (["--ros-args", "-r", "guard:__node:=left", "--remap", "__ns:=/lab"], "/lab/left"),
    (["--ros-args", "-r", "rig:__node:=left"], "/flexarm/guard"),
    (["--ros-args", "-r", "__ns:=/"], "/guard"),
    (["--ros-args", "-r", "__node:=left", "--", "-r", "__node:=right"], "/flexarm/left"),
    (["--ros-args", "-r", "stop:=halt", "-p", "node:=left"], "/flexarm/guard"),
]


@pytest.mark.parametrize(("arguments", "name"), NAMES)
def test_a_node_is_renamed_by_the_first_rule_that_fits(arguments: list[str], name: str) -> None:
    assert node_name("guard", "flexarm", ["guard_node", *arguments]) == name


@pytest.mark.ros
def test_rcl_gives_the_same_names() -> None:
    rclpy = pytest.importorskip("rclpy")
    from rclpy.context import Context
    from rclpy.node import Node

    for arguments, name in NAMES:
        context = Context()
        rclpy.init(args=["guard_node", *arguments], context=context, domain_id=77)
        node = Node("guard", namespace="flexarm", context=context, start_parameter_services=False)
        assert node.get_fully_qualified_name() == name
        node.destroy_node()
        rclpy.shutdown(context=context)


def test_values_are_read_in_the_ros_part_only() -> None:
    line = [
        "x",
        "-p",
        "a:=1",
        "--ros-args",
        "-p",
        "b:=2",
        "--",
        "-p",
        "c:=3",
        "--ros-args",
        "--param",
        "d:=4",
    ]
    assert list(values_of(line, ("-p", "--param"))) == ["b:=2", "d:=4"]


def test_the_domain_is_that_of_the_environment() -> None:
    assert [domain(given) for given in ({}, {"ROS_DOMAIN_ID": ""}, {"ROS_DOMAIN_ID": "07"})] == [
        "0",
        "0",
        "7",
    ]


@pytest.mark.parametrize("value", ["lab", "-1", "1.5", "233", " ", "²", "٣"])
def test_what_is_no_domain_is_refused_with_variable_value_and_what_is_allowed(value: str) -> None:
    with pytest.raises(ValueError, match=f"^ROS_DOMAIN_ID: '{value}': expected a whole number, 0 to 232$"):
        domain({"ROS_DOMAIN_ID": value})


@pytest.mark.parametrize(
    ("line", "asks"),
    [("--help", True), ("-h --ros-args -p a:=1", True), ("--ros-args -p a:=1 -- --help", True),
     ("--ros-args --help", False), ("--ros-args -h", False), ("", False)],
)  # fmt: skip
def test_help_is_asked_of_the_node_outside_of_what_is_for_ros(line: str, asks: bool) -> None:
    assert asks_help(line.split()) == asks
