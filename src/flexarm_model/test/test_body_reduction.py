"""Interfaces of a body are nodes that it has."""

from dataclasses import replace

import numpy as np
import pytest

from flexarm_model.bodies import kept_beams
from flexarm_model.bodies.beam_superelement import reduce_beam
from flexarm_model.bodies.body_reduction import KeptReductions, reduce_body, reduce_to_first_order
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError

STRIP = load_config(find_manipulator("single_link")).bodies["strip"]
HUB = load_config(find_manipulator("planar_3rrr")).bodies["platform"]


@pytest.mark.parametrize("reduce", [reduce_body, reduce_to_first_order, KeptReductions()])
def test_a_node_that_a_body_does_not_have_is_refused_with_those_that_it_has(reduce):
    """A misspelt one was left out: the strip's third mode then was one of 106 instead of 178 Hz."""
    with pytest.raises(ValueError, match=r"body 'strip': no node toe, tp; its nodes: root, .*tip"):
        reduce(STRIP, ["root", "tp", "toe"])
    with pytest.raises(ValueError, match=r"body 'platform': no node nowhere; its nodes: "):
        reduce(HUB, ["nowhere"])


@pytest.mark.parametrize("reduce", [reduce_body, reduce_to_first_order, KeptReductions()])
def test_one_name_alone_is_no_list_of_interfaces(reduce):
    with pytest.raises(ValueError, match="body 'strip': interfaces: expected a list of nodes, not 'root'"):
        reduce(STRIP, "root")


def test_a_body_that_cannot_be_reduced_is_a_fault_of_the_configuration():
    """Nodes answer those with one line and code 2; of an imported body they ended with a traceback and 1."""
    many = replace(STRIP, reduction=replace(STRIP.reduction, modes=900))
    for reduce in (reduce_body, reduce_to_first_order, KeptReductions()):
        with pytest.raises(ConfigError, match="body 'strip': 900 modes asked for"):
            reduce(many, ["root", "tip"])


def test_beams_of_one_make_are_reduced_once_and_nobody_writes_into_them(monkeypatch):
    reduced = []
    monkeypatch.setattr(kept_beams, "_KEPT", {})
    count = lambda *a, **k: reduced.append(a[0]) or reduce_beam(*a, **k)  # noqa: E731
    monkeypatch.setattr(kept_beams, "reduce_beam", count)
    one, twin = reduce_body(STRIP, ["tip"]), reduce_body(replace(STRIP, name="twin"), ["tip"])
    assert (one.name, twin.name, len(reduced)) == ("strip", "twin", 1)
    for part in (one, *one.nodes.values()):
        assert not any(x.flags.writeable for x in vars(part).values() if isinstance(x, np.ndarray))
    reduce_body(STRIP, ["root", "tip"])
    reduce_body(replace(STRIP, damping_time=1e-5), ["tip"])
    reduce_to_first_order(STRIP, ["tip"])
    assert len(reduced) == 4
    monkeypatch.setattr(kept_beams, "_MOST", 5)
    for k in range(3):
        reduce_body(replace(STRIP, damping_time=1e-4 * k), ["tip"])
    assert len(kept_beams._KEPT) == 5
