"""The service of the tree's dynamics: what it refuses, and that what it answers is finite."""

import pytest
from lone_node import run_beside

pytestmark = pytest.mark.ros
NODE = """
import rclpy, numpy as np
from flexarm_interfaces.srv import GetDynamics
from flexarm_model.model_node import ModelNode
rclpy.init()
node = ModelNode()
n = node.cache.tree.n_q

def ask(q, v):
    response = node._answering.on_get_dynamics(GetDynamics.Request(q=q, v=v), GetDynamics.Response())
    told = [*response.mass, *response.coriolis, *response.gravity]
    print(response.success, len(told) > 0, bool(np.isfinite(told).all()), response.message[:50])

"""
ASKED = """
ask([], [])
ask([1e6] * n, [1e6] * n)
ask([1e200] * n, [1e200] * n)
ask([], [float("nan")] * n)
ask([0.0], [])
"""


def test_coordinates_of_which_no_number_comes_are_refused() -> None:
    """1e200 rad were answered with success, and NaN."""
    refused = "False False True q and v need 4 numbers each, of at most 1e+06 in s"
    assert run_beside(NODE, ASKED) == ["True True True "] * 2 + [refused] * 3
