"""Services of the model node: the served model at any pose, the equations of motion at any state.

Services
    get_reduced_model (flexarm_interfaces/GetReducedModel): the model at any pose.
    get_dynamics (flexarm_interfaces/GetDynamics): M, C v and G at a state of the tree.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from flexarm_interfaces.srv import GetDynamics, GetReducedModel
from rclpy.node import Node

from flexarm_model.conversions import floats, model_to_msg
from flexarm_model.served.linearize import PoseError
from flexarm_model.served.model_cache import ModelCache
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError

MOST = 1e6  # SI, of a coordinate or its velocity; M, C v and G are finite then


class ModelServices:
    """Answers for one arm."""

    def __init__(
        self, node: Node, cache: Callable[[], ModelCache], newest: Callable[[], ReducedModel]
    ) -> None:
        """Offer the services.

        Args:
            node: Offers them.
            cache: Returns the models of the arm as it is now.
            newest: Returns the model that was sent last.
        """
        self._cache, self._newest = cache, newest
        node.create_service(GetReducedModel, "get_reduced_model", self.on_get_reduced_model)
        node.create_service(GetDynamics, "get_dynamics", self.on_get_dynamics)

    def on_get_reduced_model(
        self, request: GetReducedModel.Request, response: GetReducedModel.Response
    ) -> GetReducedModel.Response:
        """Answer with the model at the requested pose."""
        try:
            model = self._cache().at(np.array(request.pose)) if request.pose else self._newest()
        except (PoseError, ClosureError) as error:
            response.success, response.message = False, str(error)
            return response
        response.success, response.model = True, model_to_msg(model)
        return response

    def on_get_dynamics(
        self, request: GetDynamics.Request, response: GetDynamics.Response
    ) -> GetDynamics.Response:
        """Answer with M(q), C(q, v) v and G(q)."""
        tree = self._cache().tree
        n = tree.n_q
        q = np.array(request.q) if request.q else np.array(self._newest().q0)
        v = np.array(request.v) if request.v else np.zeros(n)
        if q.size != n or v.size != n or not (abs(np.array([q, v])) <= MOST).all():  # also NaN
            response.success, names = False, ", ".join(tree.coordinates)
            response.message = f"q and v need {n} numbers each, of at most {MOST:g} in size: {names}"
            return response
        static = np.array(tree.functions["motion"](q, np.zeros(n))[1])
        response.success, response.names = True, list(tree.coordinates)
        response.coriolis = floats(np.array(tree.functions["motion"](q, v)[1]) - static)
        response.gravity = floats(static)
        response.mass = floats(np.array(tree.functions["motion"](q, v)[0]))
        return response
