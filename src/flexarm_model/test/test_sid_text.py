"""The grammar of standard input data: comments behind values, any blanks, signs of comments in texts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_sid_file import beam, foreign, rigid
from test_sid_mass import part_of

from flexarm_model.bodies.sid_file import read_sid, write_sid
from flexarm_model.bodies.sid_text import Block, parse_blocks
from flexarm_model.settings.strict_yaml import ConfigError


def parse(*lines: str) -> Block:
    return parse_blocks(Path("q.sid"), lines)


@pytest.mark.parametrize("mark", [" ! c", " # c", "\t!c", " !", "  # a = 5 ! b"])
def test_a_comment_may_stand_behind_every_line(mark: str, tmp_path: Path) -> None:
    """The page said that both signs begin comments, and ``mass = 0.2472 ! kg`` was not a number."""
    path = tmp_path / "q.sid"
    expected = foreign(beam(), path)
    lines = part_of(beam(), path).splitlines()
    path.write_text("\n".join(["! all of it", *(line + mark for line in lines)]) + "\n", encoding="utf-8")
    back = read_sid(path)
    assert back.mass == expected.mass and list(back.nodes) == list(expected.nodes)
    for item in ("s", "P", "K", "D"):
        np.testing.assert_array_equal(getattr(back, item), getattr(expected, item))


def test_tabs_are_blanks(tmp_path: Path) -> None:
    path = tmp_path / "q.sid"
    tabs = "\r\n".join(line.replace(" ", "\t") for line in part_of(rigid(), path).splitlines())
    path.write_bytes(tabs.encode())
    np.testing.assert_array_equal(read_sid(path).P, foreign(rigid(), tmp_path / "r.sid").P)


def test_what_stands_inside_a_word_begins_no_comment() -> None:
    file = parse("new node = P#3", "key = a!b ! this does", "end node")
    (node,) = file.blocks
    assert node.label == "P#3" and node.values == {"key": "a!b"}


NAMES = ["tip # 2", "#1", "! a", " both sides ", "a\t!b", "P#3", "a = b", '5 " pipe']


@pytest.mark.parametrize("name", NAMES)
def test_names_that_hold_the_sign_of_a_comment_come_back(name: str, tmp_path: Path) -> None:
    body = rigid()
    named = replace(body, name=name, nodes={name: body.nodes["root"], "far": body.nodes["far"]})
    write_sid(named, tmp_path / "q.sid")
    back = read_sid(tmp_path / "q.sid")
    assert back.name == name and list(back.nodes) == [name, "far"]


def test_a_name_that_cannot_be_quoted_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="name '5\" # 2': cannot be written"):
        write_sid(replace(rigid(), name='5" # 2'), tmp_path / "q.sid")


def test_a_block_may_begin_with_the_letters_of_a_keyword() -> None:
    file = parse("newest", "ending = 1", "end newest", "endless", "end")
    assert [block.name for block in file.blocks] == ["newest", "endless"]


def test_an_end_of_another_block_is_refused_with_its_line() -> None:
    with pytest.raises(ConfigError, match=r"q\.sid: line 2: part: 'end\tpart2' closes no block"):
        parse("part", "end\tpart2 ! c")
