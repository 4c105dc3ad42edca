"""What the nonlinear controller keeps for an arm, whatever model is served: equations, motion expected.

The coordinates are the same for all models of an arm, so the guess goes on when the model changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.nonlinear.arm_equations import (
    ArmEquations,
    Coordinates,
    choose_coordinates,
    compile_arm,
)
from flexarm_controller.nonlinear.gauss_steps import GaussSteps
from flexarm_controller.nonlinear.motion_guess import MotionGuess
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


class NonlinearArm:
    """Equations of one arm at one control period.

    Attributes:
        coordinates: Those of the equations.
        steps: Integrator.
        guess: Motion that is expected.
    """

    def __init__(self, config: ManipulatorConfig, settings: NmpcConfig, dt: float, horizon: int) -> None:
        """Build and compile; takes seconds the first time, then it is in the cache.

        Args:
            config: The arm.
            settings: Which modes are states.
            dt: Control period [s].
            horizon: Periods that are looked ahead.

        Raises:
            NonlinearModelError: The arm has loops, or there is no C compiler.
        """
        self._tree = ReducedTree(config)
        self.coordinates: Coordinates = choose_coordinates(self._tree, settings.mode_turn / dt)
        equations: ArmEquations = compile_arm(self._tree, self.coordinates)
        self.steps = GaussSteps(equations, dt)
        self.guess = MotionGuess(self.steps, horizon)

    def mass_at(self, q: Array) -> Array:
        """Return the mass matrix of the tree, (n_q, n_q), at its coordinates q (n_q,)."""
        return self._tree.mass_matrix(q)
