"""An arm whose equation of motion is a served model's, for tests that compare with the linear controller."""

import casadi as ca

from flexarm_controller.nonlinear.arm_equations import Coordinates, compile_equations
from flexarm_controller.nonlinear.gauss_steps import GaussSteps
from flexarm_controller.nonlinear.motion_guess import MotionGuess


class LinearArm:
    """What the nonlinear controller needs of an arm, in the coordinates of ``model``."""

    def __init__(self, model, dt, horizon):
        n = model.n
        y, w, a = (ca.SX.sym(name, n) for name in ("y", "w", "a"))
        force = model.M @ a + model.D @ w + model.K @ (y - model.xi0) + model.f0
        equations = compile_equations(ca.Function("force", [y, w, a], [force]), model.n_theta)
        self.steps = GaussSteps(equations, dt)
        self.guess = MotionGuess(self.steps, horizon)
        self.coordinates = Coordinates(model.Phi.copy(), model.q0 - model.Phi @ model.xi0)
        self._mass = model.M

    def mass_at(self, q):
        return self._mass
