"""The arm that is really there: a nonlinear model the controller does not know.

The reduced tree of the same description with more elastic coordinates, perturbed parameters, friction
and the play of its gears, integrated with fixed substeps over one control period: explicit where that is
fast, linearly implicit for loops and stiff arms. With ``servo`` the actuated axes follow a prescribed
acceleration instead of a torque: the ideal servo that open-loop motions are compared on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.backlash import gaps_of, rest_at_home, steps_for_teeth
from flexarm_bringup.sim.explicit_steps import ExplicitSteps, substeps_needed
from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_bringup.sim.spring_change import at_points
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

MOST_EXPLICIT = 60  # substeps per period; with more of them implicit steps are faster
RESOLUTION = 0.5  # rad that the fastest served mode turns in a step: 2 % slower there, 0.1 % at a quarter
COARSE = 1.05  # rad of others below half the control rate: 9 % slower at most, whatever is served
_DRIVEN = "the simulated arm was driven there, as by a law that makes it unstable: see 'flexarm margins'"


class Steps(Protocol):
    """An integrator over one control period; both ways return q, v and the acceleration at its end."""

    substeps: int

    def drive(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array]:
        """Move under torques."""
        ...

    def servo(self, q: Array, v: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """Move with the actuated axes accelerated as prescribed."""
        ...

    def follow(self, tree: ReducedTree) -> None:
        """Let springs and dampers be those of the same tree under other parameters."""
        ...


class Plant:
    """State and motion of the arm."""

    def __init__(self, config: ManipulatorConfig, dt: float, settings: PlantSettings | None = None) -> None:
        """Build and compile the plant, at rest at the home pose.

        Args:
            config: The manipulator as described.
            dt: Control period [s].
            settings: How the real arm differs.
        """
        self.settings = settings or PlantSettings()
        self._compiled = self.tree = ReducedTree(perturb(config, self.settings))
        self.dt = dt
        self._steps = choose_steps(self.tree, dt, self.settings.friction)
        self.reset()

    @property
    def substeps(self) -> int:
        """Integration steps per control period."""
        return self._steps.substeps

    def reset(self) -> None:
        """Go back to rest at the home pose, gears on the side to which they are loaded."""
        self.q = rest_at_home(self.tree, gaps_of(self.tree))
        self.v = np.zeros(self.tree.n_q)
        self.a = np.zeros(self.tree.n_q)

    def lead(self, parameters: Mapping[str, float]) -> None:
        """Let named parameters have other values from now on [SI]; the others are as described.

        Raises:
            ParameterRangeError: There is no such parameter, or a law does not reach its value.
        """
        self.tree = self._compiled.under(parameters)
        self._steps.follow(self.tree)

    @property
    def theta(self) -> Array:
        """Actuated axes [rad or m], (n_theta,)."""
        return self.q[self.tree.actuated]

    @property
    def theta_dot(self) -> Array:
        """Their velocity, (n_theta,)."""
        return self.v[self.tree.actuated]

    def drive(self, tau: Array) -> None:
        """Advance one period under torques held constant, (n_theta,).

        Raises:
            ClosureError: They have driven it to where its loops do not close.
        """
        try:
            self.q, self.v, self.a = self._steps.drive(self.q, self.v, tau)
        except ClosureError as error:
            raise ClosureError(f"{error}; {_DRIVEN}") from None

    def servo(self, acceleration: Array) -> None:
        """Advance one period with the actuated axes accelerated as prescribed, (n_theta,)."""
        self.q, self.v, self.a = self._steps.servo(self.q, self.v, acceleration)

    def outputs(self) -> Array:
        """Return the output rows as the sensors feel them at the end of the period, (n_y,)."""
        return np.array(self.tree.functions["outputs"](self.q, self.v, self.a, self.q))

    def tip_pose(self) -> Array:
        """Return ``T_world_tip``, (4, 4); the loops are closed at every tick."""
        return np.array(self.tree.functions["tip_pose"](self.q))


def choose_steps(tree: ReducedTree, dt: float, friction: float) -> Steps:
    """Return the integrator that fits: explicit for open arms whose modes are all slow enough.

    Raises:
        ValueError: It is a loop of rigid bodies.
    """
    teeth = steps_for_teeth(tree, dt)
    if not tree.n_c:
        substeps = max(*(substeps_needed(other, dt, friction) for other in (tree, *at_points(tree))), teeth)
        if substeps <= MOST_EXPLICIT:
            return ExplicitSteps(tree, dt, substeps, friction)
    from flexarm_bringup.sim.implicit_steps import ImplicitSteps  # loads SciPy

    return ImplicitSteps(tree, dt, max(teeth, _steps_for_modes(tree, dt)), friction)


def _steps_for_modes(tree: ReducedTree, dt: float) -> int:
    """Return how many implicit steps of a period ``dt`` [s] follow the modes of a tree, served or not.

    Raises:
        ValueError: It is a loop of rigid bodies.
    """
    count = tree.n_q - tree.n_c - len(tree.actuated)
    if not count and tree.n_c:
        raise ValueError(f"'{tree.config.name}': a loop without any elastic mode cannot be simulated")
    omega = linearize(tree, modes=count).omega
    slow = omega[omega < np.pi / dt]
    turned = [0.0, *omega[: tree.config.modes] * dt / RESOLUTION, *slow * dt / COARSE]
    return max(1, int(np.ceil(max(turned))))
