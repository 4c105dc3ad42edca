"""The solvers by name, and what stands before and behind the one that was chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.daqp_solver import DaqpSolver
from flexarm_controller.solvers.hpipm_solver import HpipmSolver
from flexarm_controller.solvers.interior_first import InteriorFirst
from flexarm_controller.solvers.osqp_solver import OsqpSolver
from flexarm_controller.solvers.qp import QpSolver
from flexarm_controller.solvers.second_attempt import SecondAttempt
from flexarm_controller.solvers.when_needed import WhenNeeded

Array = NDArray[np.float64]
Constructor = Callable[[Array, Array, MpcConfig], QpSolver]

BACKENDS: Mapping[str, Constructor] = {
    "daqp": lambda P, A, config: DaqpSolver(P, A, config.max_iterations),
    "osqp": lambda P, A, config: OsqpSolver(P, A, config.tolerance, config.max_iterations),
    "hpipm": lambda P, A, config: HpipmSolver(P, A, config.tolerance, config.max_iterations),
}
SECOND = {"daqp": "osqp", "osqp": "daqp", "hpipm": "daqp"}  # who tries when the first does not vouch


def solvers_of(P: Array, A: Array, config: MpcConfig) -> tuple[WhenNeeded, WhenNeeded]:
    """Return the solver that the settings ask for, and the second one, each set up when it is needed."""
    first, second = (
        WhenNeeded(partial(BACKENDS[name], P, A, config)) for name in (config.backend, SECOND[config.backend])
    )
    return first, second


def build_solver_for_once(P: Array, A: Array, n_v: int, config: MpcConfig) -> QpSolver:
    """Return both behind the interior check, for a program that is asked once or twice."""
    return InteriorFirst(P, A, n_v, SecondAttempt(*solvers_of(P, A, config)))
