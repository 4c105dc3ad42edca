"""The served form as a value: its identity, its names, its immutability."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from arms import arm, tree

from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree


@cache
def model() -> ReducedModel:
    return linearize(tree("single_link"))


def nudged(value: Any) -> Any:
    """Return the value changed by as little as it can be."""
    if isinstance(value, np.ndarray):
        other = value.copy()
        other.flat[-1] = np.nextafter(other.flat[-1], np.inf)
        return other
    return value + "x" if isinstance(value, str) else (*value[1:], "x")


def test_the_identity_is_the_same_for_the_same_content() -> None:
    again = linearize(ReducedTree(arm("single_link"), use_compiler=False))
    assert again.model_id == model().model_id == replace(model()).model_id
    assert len(model().model_id) == 16


@pytest.mark.parametrize("name", [field.name for field in fields(ReducedModel) if field.name != "outputs"])
def test_the_identity_changes_with_every_field(name: str) -> None:
    other = replace(model(), **{name: nudged(getattr(model(), name))})
    assert other.model_id != model().model_id


@pytest.mark.parametrize("name", [field.name for field in fields(Outputs)])
def test_the_identity_changes_with_every_field_of_the_outputs(name: str) -> None:
    outputs = replace(model().outputs, **{name: nudged(getattr(model().outputs, name))})
    assert replace(model(), outputs=outputs).model_id != model().model_id


def test_the_identity_changes_with_the_pose() -> None:
    assert linearize(tree("single_link"), np.array([0.1])).model_id != model().model_id


@pytest.mark.parametrize(
    "name", [field.name for field in fields(ReducedModel)] + [f.name for f in fields(Outputs)]
)
def test_arrays_are_read_only(name: str) -> None:
    value = getattr(model(), name, None)
    value = getattr(model().outputs, name) if value is None else value
    if isinstance(value, np.ndarray):
        with pytest.raises(ValueError, match="read-only"):
            value.flat[0] = 1.0


def test_an_array_of_the_caller_stays_his_and_the_model_keeps_its_own() -> None:
    M, y0 = model().M.copy(), model().outputs.y0.copy()
    made = replace(model(), M=M[:, :], outputs=replace(model().outputs, y0=y0))
    before = made.model_id
    M[0, 0] = y0[0] = 99.0
    assert made.M[0, 0] == model().M[0, 0] and made.outputs.y0[0] == model().outputs.y0[0]
    assert replace(made).model_id == before == model().model_id


def test_rows_are_found_by_sensor_and_an_unknown_one_is_named_with_those_there_are() -> None:
    out = model().outputs
    assert [out.names[i] for i in out.rows("tip")] == [
        "tip.tx",
        "tip.ty",
        "tip.tz",
        "tip.rx",
        "tip.ry",
        "tip.rz",
    ]
    out.rows("tip").clear()
    assert len(out.rows("tip")) == 6, "a list of its own for everybody who asks"
    assert {name.split(".")[0] for name in out.names} == set(out.sensors)
    with pytest.raises(KeyError, match=r"'lidar' has no output row; known: camera, encoder"):
        out.rows("lidar")


def test_sizes_and_names_follow_the_content() -> None:
    assert (model().n_theta, model().n_eta, model().n) == (1, 3, 4)
    assert model().eta_names == ("mode_1", "mode_2", "mode_3") and model().theta_names == ("base.rz",)
    assert linearize(tree("single_link"), np.array([0.2])).xi0 == pytest.approx([0.2, 0, 0, 0])


def test_the_same_numbers_in_another_shape_are_another_model() -> None:
    turned = replace(model(), Phi=model().Phi.ravel())
    assert turned.model_id != model().model_id
