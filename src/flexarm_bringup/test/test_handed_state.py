"""A state that is handed over says what its message would have said."""

from dataclasses import fields

import numpy as np
import pytest

from flexarm_estimator.estimate import Estimate
from flexarm_estimator.state.state_layout import StateLayout
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

pytestmark = pytest.mark.ros
handed_state = pytest.importorskip("flexarm_bringup.processes.handed_state", reason="needs ROS")
conversions = pytest.importorskip("flexarm_estimator.conversions", reason="needs ROS")
told_state = pytest.importorskip("flexarm_controller.told_state", reason="needs ROS")

EPOCH_NS, STAMP_NS = 1_700_000_000_000_000_000, 1_700_000_001_234_567_891
MODEL = linearize(ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False))


def estimate(rng: np.random.Generator, status: str = "ok", **parts: int) -> Estimate:
    layout = StateLayout(MODEL.n, MODEL.n_theta, biases=("root_strain.axial",), **parts)
    root = rng.normal(size=(layout.n_x, layout.n_x))
    return Estimate(
        1.0, MODEL.model_id, rng.normal(size=layout.n_x), root @ root.T, layout, status, "why", (), 1.25,
        np.eye(4), np.zeros(6), np.eye(6), np.eye(6),
    )  # fmt: skip


def both_read(told: Estimate, model=MODEL):
    sent = told_state.SentState(conversions.state_to_msg(told, MODEL, STAMP_NS))
    handed = handed_state.HandedState(told, STAMP_NS)
    assert sent.stamp_ns == handed.stamp_ns
    return sent.read(model, EPOCH_NS), handed.read(model, EPOCH_NS)


@pytest.mark.parametrize("status", ["ok", "degraded", "lost", "starting"])
@pytest.mark.parametrize("parts", [{}, {"n_s": 2}, {"n_p": 1, "n_learned": 2}])
def test_the_controller_reads_the_same_of_an_estimate_as_of_its_message(status, parts):
    sent, handed = both_read(estimate(np.random.default_rng(5), status, **parts))
    for field in fields(sent):
        np.testing.assert_array_equal(getattr(sent, field.name), getattr(handed, field.name), field.name)


def test_a_variance_that_is_none_is_no_precision():
    told = estimate(np.random.default_rng(6))
    P = told.P.copy()
    P[1, 1], P[2, 2] = -1.0, np.nan
    sent, handed = both_read(told._replace(P=P))
    np.testing.assert_array_equal(sent.sigma, handed.sigma)
    assert handed.sigma[1:3].tolist() == [np.inf, np.inf]


def test_a_state_of_another_size_is_not_usable():
    short = linearize(ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False), modes=1)
    sent, handed = both_read(estimate(np.random.default_rng(7)), short)
    assert not sent.usable and not handed.usable
    assert handed.reason == f"state has 1 axes and {MODEL.n_eta} modes"
    assert handed.eta.shape == sent.eta.shape == (1,)
