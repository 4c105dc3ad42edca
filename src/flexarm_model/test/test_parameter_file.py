"""Parameter files are for somebody, give something, give it once; parameters from them are told."""

from pathlib import Path

import pytest
import yaml

from flexarm_model.ros.parameter_file import (
    COMMAND_LINE,
    parameter_sources,
    read_parameter_file,
    refuse_strangers,
    refuse_stray,
)
from flexarm_model.settings.strict_yaml import ConfigError

NODE = "/flexarm/controller"


def written(folder: Path, text: str) -> Path:
    path = folder / "given.yaml"
    path.write_text(text, encoding="utf8")
    return path


@pytest.mark.parametrize(
    ("name", "gets_it"),  # each line as rcl of Jazzy answers it
    [
        ("/flexarm/controller", True),
        ("flexarm/controller", True),
        ("controller", False),
        ("/controller", False),
        ("/**", True),
        ("/flexarm/*", True),
        ("/*", False),
        ("/**/controller", True),
        ("/flexarm/controller_2", False),
    ],
)
def test_a_section_is_for_the_nodes_that_rcl_gives_it_to(name: str, gets_it: bool, tmp_path: Path) -> None:
    source = read_parameter_file(written(tmp_path, f"{name}:\n  ros__parameters: {{law: mpc}}\n"))
    assert source.keys_for(NODE) == (("law",) if gets_it else ())


def test_nested_namespaces_and_nested_keys_are_joined(tmp_path: Path) -> None:
    text = "flexarm:\n  controller:\n    ros__parameters: {a: {b: 1, c: [2]}, d: x}\n"
    assert read_parameter_file(written(tmp_path, text)).keys == {NODE: ("a.b", "a.c", "d")}


def test_lists_as_launch_ros_writes_them_are_lists(tmp_path: Path) -> None:
    """launch_ros 0.26.6 evaluates every list to a tuple, and ``yaml.dump`` tags it; rcl does not mind."""
    written_by_launch = yaml.dump(
        {"/**": {"ros__parameters": {"cores": (0, 1), "start": (0.5,), "names": ("a",)}}}
    )
    assert "!!python/tuple" in written_by_launch
    source = read_parameter_file(written(tmp_path, written_by_launch))
    assert source.keys_for(NODE) == ("cores", "names", "start")
    with pytest.raises(ConfigError, match="is not YAML: could not determine a constructor"):
        read_parameter_file(written(tmp_path, "/**: {ros__parameters: {a: !!python/object:os.system {}}}"))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "must hold keys and values"),
        ("- 1\n", "must hold keys and values"),
        (f"{NODE}: {{law: mpc}}\n", "expected 'node: ros__parameters: key: value'"),
        (f"{NODE}: {{ros__parameters: {{}}}}\n", "with at least one key"),
        (f"{NODE}: {{ros__parameters: }}\n", "with at least one key"),
        (f"{NODE}: {{ros_parameters: {{law: mpc}}}}\n", "law: 'mpc': expected 'node: ros__parameters"),
        (f"{NODE}: {{ros__parameters: {{law: }}}}\n", "law: has no value"),
        (f"{NODE}: {{ros__parameters: {{law: a, law: b}}}}\n", "key 'law' is given twice"),
        (f"{NODE}: {{ros__parameters: {{a: {{b: 1}}, a.b: 2}}}}\n", f"{NODE}: a.b: is given twice"),
        (
            f"{NODE}: {{ros__parameters: {{start: [[0.0]]}}}}\n",
            f"{NODE}: start: [[0.0]]: expected a list of si",
        ),
        (f"{NODE}:\n  ros__parameters:\n    rate: 010\n", "line 3: '010' begins with a zero"),
        (f"{NODE}:\n  ros__parameters:\n    start: [-08]\n", "line 3: '-08' begins with a zero"),
        (f"{NODE}: [not\n", "is not YAML"),
    ],
)
def test_what_is_no_parameter_file_is_refused_with_its_name(text: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as refused:
        read_parameter_file(written(tmp_path, text))
    assert reason in str(refused.value) and "given.yaml" in str(refused.value)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (NODE, NODE[1:]),
        (NODE, f"{NODE}/"),
        ("flexarm: controller", NODE),
        ("/flexarm: /controller", "flexarm: controller"),
        ("'/**'", "'**'"),
    ],
)
def test_a_node_comes_once_however_it_is_spelt(first: str, second: str, tmp_path: Path) -> None:
    """rcl hands over both sections, and the later one had the last word."""
    text = "".join(f"{_nested(name, '{ros__parameters: {law: mpc}}')}\n" for name in (first, second))
    with pytest.raises(ConfigError) as refused:
        read_parameter_file(written(tmp_path, text))
    spellings = (f"'{name.replace(chr(39), '')}'" for name in (first, second))
    assert f"given.yaml: {' and '.join(spellings)} are the same node, /" in str(refused.value)


def _nested(name: str, inside: str) -> str:
    for part in reversed(name.split(": ")):
        inside = f"{{{part}: {inside}}}"
    return inside[1:-1]


def test_a_section_for_one_node_may_stand_beside_one_for_many(tmp_path: Path) -> None:
    text = "".join(
        f"{name}: {{ros__parameters: {{law: mpc}}}}\n" for name in ("/**", "/*", "/flexarm/*", NODE)
    )
    source = read_parameter_file(written(tmp_path, text))
    assert tuple(source.keys) == ("/**", "/*", "/flexarm/*", NODE)
    assert source.keys_for(NODE) == ("law", "law", "law")  # one of them is for nodes without a namespace


def test_files_for_others_of_the_graph_are_shared_but_nobody_is_misspelt(tmp_path: Path) -> None:
    shared = f"{NODE}: {{ros__parameters: {{a: 1}}}}\n/flexarm/estimator: {{ros__parameters: {{b: 1}}}}\n"
    refuse_strangers(read_parameter_file(written(tmp_path, shared)), NODE)
    refuse_strangers(read_parameter_file(written(tmp_path, "/mine: {ros__parameters: {a: 1}}\n")), "/mine")
    misspelt = shared.replace("estimator", "estimatr")
    with pytest.raises(
        ConfigError, match=r"given.yaml: /flexarm/estimatr: no such node; allowed: /\*\*, /flex"
    ):
        refuse_strangers(read_parameter_file(written(tmp_path, misspelt)), NODE)
    with pytest.raises(
        ConfigError, match="/flexarm/controller, /flexarm/estimator: holds nothing for /flexarm/ri"
    ):
        refuse_strangers(read_parameter_file(written(tmp_path, shared)), "/flexarm/rig")


def test_one_file_may_be_for_two_arms_but_no_namespace_is_misspelt(tmp_path: Path) -> None:
    """The usual file of ROS, with a section for every node of a system, was refused by each of them."""
    sections = "".join(
        f"/{space}/{name}: {{ros__parameters: {{a: 1}}}}\n"
        for space, name in (("left", "rig"), ("left", "guard"), ("right", "rig"), ("right", "model"))
    )
    both = read_parameter_file(written(tmp_path, sections))
    for node in ("/left/rig", "/right/rig", "/right/model"):
        refuse_strangers(both, node)
    with pytest.raises(ConfigError, match="/right/rigg: no such node"):
        refuse_strangers(
            read_parameter_file(written(tmp_path, sections.replace("right/model", "right/rigg"))), "/left/rig"
        )
    alone = sections.replace("right/rig", "rigth/guad").replace("right/model", "rigth/model")
    with pytest.raises(ConfigError, match="/rigth/guad: no such node"):
        refuse_strangers(read_parameter_file(written(tmp_path, alone)), "/left/rig")
    misspelt = "/flexarm/rig: {ros__parameters: {a: 1}}\n/flexam/guard: {ros__parameters: {a: 1}}\n"
    with pytest.raises(ConfigError, match="/flexam/guard: no such node"):
        refuse_strangers(read_parameter_file(written(tmp_path, misspelt)), "/flexarm/rig")


def test_nodes_of_one_process_may_each_have_a_file_of_their_own(tmp_path: Path) -> None:
    own = read_parameter_file(written(tmp_path, f"{NODE}: {{ros__parameters: {{a: 1}}}}\n"))
    refuse_strangers(own, "/flexarm/estimator", beside=("controller",))
    with pytest.raises(ConfigError, match="nothing for /flexarm/rig; allowed: /flexarm/rig, /flexarm/mo"):
        refuse_strangers(own, "/flexarm/rig", beside=("model",))


def test_the_ros_part_of_a_command_line_tells_its_files_and_keys(tmp_path: Path) -> None:
    path = written(tmp_path, f"{NODE}: {{ros__parameters: {{law: mpc}}}}\n")
    words = ["node", "-p", "not:=ours", "--ros-args", "--params-file", str(path), "-p", "rate:=a:b:=c"]
    words += ["--param", "controller:law:=lqr", "--", "-p", "nor:=this"]
    file, typed = parameter_sources(words)
    assert (file.name, file.keys_for(NODE)) == (str(path), ("law",))
    assert (typed.name, typed.keys_for(NODE)) == (COMMAND_LINE, ("rate",))
    with pytest.raises(ConfigError, match="command line: /controller: no such node"):
        refuse_strangers(typed, NODE)


def test_without_ros_arguments_nothing_is_given() -> None:
    assert parameter_sources(["node"]) == ()


def test_what_is_not_for_ros_is_refused_with_how_it_is_meant() -> None:
    """A node that was given ``rate:=5.0`` alone ran with its default."""
    refuse_stray(["model_node", "--ros-args", "-p", "rate:=5.0", "--"])
    with pytest.raises(ConfigError, match="rate:=5.0: not understood; .*--ros-args -p"):
        refuse_stray(["model_node", "rate:=5.0", "--ros-args", "-r", "__node:=model"])
