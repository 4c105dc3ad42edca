"""The filter's state in nonlinear motion: its derivative, its sensors' rows, and their derivatives.

``x = [xi; xi'; z]`` moves by ``x' = F(x, u) + G w``. xi'' comes from the moving arm. How the other states z
(unmodelled torques, biases) change, which forces they are and what they add to the rows is linear, and the
served system says it: forces ``M A_z z`` on xi, ``C_z z - D_w M A_z z`` in the rows. What is learned of the
model (``bilinear``) is forces, too: ``sum p_i F_i x``, and so are springs that are others than the described
arm's (``served_springs``).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.moving_arm import Motion, MovingArm
from flexarm_estimator.filters.served_springs import spring_force
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import SensorModels
from flexarm_estimator.steps.bilinear import Bilinear, Slope, value
from flexarm_estimator.steps.taylor import ExponentialIntegrals
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


class NoFlow(ValueError):
    """The arm's motion cannot be computed at this state."""


class LocalStep(NamedTuple):
    """One step about a state, the torque held.

    Attributes:
        x: State at its end without noise, (n_x,).
        A: Transition, (n_x, n_x).
        integral: ``int_0^dt e^{A_c s} ds``, (n_x, n_x).
        Q: Covariance of the process noise, (n_x, n_x).
        force_cross: Its covariance with the averaged force noise, (n_x, n).
    """

    x: Array
    A: Array
    integral: Array
    Q: Array
    force_cross: Array


class LocalRows(NamedTuple):
    """Sensors' rows about a state.

    Attributes:
        y: Without noise, (n_y,).
        C: Derivative by the state, (n_y, n_x).
        D_w: Derivative by the force noise, (n_y, n).
    """

    y: Array
    C: Array
    D_w: Array


class StateFlow:
    """Flow of the state of one served model.

    Attributes:
        arm: Motion in the served coordinates.
        dependent: Tree coordinates that follow the others where loops close.
        forces: Forces on xi, (n,), of state and inputs ``[tau; 1]``.
        rows_of_rest: What the states that are not of the arm add to the rows, (n_y, n_x).
    """

    def __init__(
        self,
        arm: MovingArm,
        model: ReducedModel,
        process: ProcessModel,
        models: SensorModels,
        averaging: float,
    ) -> None:
        """Bind the parts; the arm's rows are those of ``models.rows``, in their order, switched off or not.

        Args:
            arm: Motion in the served coordinates.
            model: The served model.
            process: Its noise.
            models: Its sensors.
            averaging: Time over which an accelerometer averages the force noise [s].
        """
        self.arm, self._averaging, self._n = arm, averaging, model.n
        self.dependent = arm.dependent
        system = process.system
        self._A, self._Q = system.A, system.Q
        rest = slice(2 * model.n, system.n_x)
        self._learned = tuple(enumerate(system.learned, system.n_x - len(system.learned)))
        push = model.M @ system.A[model.n : 2 * model.n, rest]  # (n, n_z)
        springs = spring_force(arm, model)
        of_u = np.column_stack([model.B, springs.constant])
        learned = tuple(Slope(slope, np.zeros_like(of_u)) for slope in system.learned)
        self.forces = Bilinear(np.hstack([springs.slope, push]), of_u, learned)
        self._force_cov = process.force_cov
        self._force_psd = process.force_cov * averaging
        whole = [model.whole for model in models.rows.values()]
        starts = np.cumsum([0, *(len(rows.C) for rows in whole)]).tolist()
        self._rows = {
            name: [start + row for row in model.kept]
            for start, (name, model) in zip(starts, models.rows.items(), strict=False)
        }
        self.rows_of_rest = np.zeros((starts[-1], system.n_x))
        for start, rows in zip(starts, whole, strict=False):
            own = slice(start, start + len(rows.C))
            self.rows_of_rest[own, rest] = rows.C[:, rest] - rows.D_w @ push

    def warm_up(self, xi: Array) -> None:
        """Compile what is needed, at rest at ``xi`` (n,), so that the first step need not."""
        x, u = np.zeros(self._A.shape[0]), np.append(np.zeros(self.forces.of_u.shape[1] - 1), 1.0)
        x[: self._n] = xi
        self.linear_rows(x, u)

    def rows_of(self, names: Iterable[str]) -> list[int]:
        """Return which rows of y belong to some sensors."""
        return [i for name in names for i in self._rows[name]]

    def derivative(self, x: Array, u: Array) -> Array:
        """Return x', (n_x,).

        Raises:
            NoFlow: The arm cannot be there.
        """
        return self._derivative(x, self._move(x, u))

    def step(self, x: Array, u: Array, dt: float) -> LocalStep:
        """Return the step over ``dt`` by the exponential of the motion's tangent at ``x``.

        ``x+ = x + I(dt) F(x, u)``: exact for a linear arm, of second order in ``dt`` otherwise.

        Raises:
            NoFlow: The arm cannot be there.
        """
        motion = self._move(x, u)
        n = self._n
        A, Q, G = self._A.copy(), self._Q.copy(), np.zeros((x.size, n))
        A[n : 2 * n, : 2 * n] = self.arm.slopes(motion).accel
        A[n : 2 * n, 2 * n :] = 0.0
        A[n : 2 * n] += motion.M_inv.dot(self._force_slope(x))
        Q[n : 2 * n, n : 2 * n] = motion.M_inv.dot(self._force_psd).dot(motion.M_inv)
        G[n : 2 * n] = motion.M_inv
        if not (np.isfinite(A).all() and np.isfinite(Q).all()):
            raise NoFlow("the motion's tangent is not finite")
        with np.errstate(all="ignore"):  # a wild state; what comes of it is checked
            E, integral, noise, overlap = self._integrate(A, Q, dt)
            after = x + integral.dot(self._derivative(x, motion))
            cross = overlap.dot(G).dot(self._force_cov)
        if not (np.isfinite(after).all() and np.isfinite(noise).all()):
            raise NoFlow("the step is not finite")
        return LocalStep(after, E, integral, noise, cross)

    def rows(self, x: Array, u: Array) -> Array:
        """Return the sensors' rows, (n_y,).

        Raises:
            NoFlow: The arm cannot be there.
        """
        rows: Array = self.arm.rows(self._move(x, u)) + self.rows_of_rest.dot(x)
        return rows

    def acceleration_and_rows(self, x: Array, u: Array) -> tuple[Array, Array]:
        """Return xi'', (n,), and the sensors' rows, (n_y,), of one state.

        Raises:
            NoFlow: The arm cannot be there.
        """
        motion = self._move(x, u)
        return motion.xi_ddot, self.arm.rows(motion) + self.rows_of_rest.dot(x)

    def linear_rows(self, x: Array, u: Array) -> LocalRows:
        """Return the rows with their derivatives.

        Raises:
            NoFlow: The arm cannot be there.
        """
        motion = self._move(x, u)
        slopes = self.arm.slopes(motion)
        C = self.rows_of_rest.copy()
        C[:, : 2 * self._n] = slopes.rows
        D_w = slopes.rows_a.dot(motion.M_inv)
        C += D_w.dot(self._force_slope(x))
        if not np.isfinite(C).all():
            raise NoFlow("the rows' tangent is not finite")
        return LocalRows(self.arm.rows(motion) + self.rows_of_rest.dot(x), C, D_w)

    def _move(self, x: Array, u: Array) -> Motion:
        n = self._n
        try:
            motion = self.arm.at(x[:n], x[n : 2 * n], value(*self.forces, (x, u)))
        except (ValueError, np.linalg.LinAlgError) as error:
            raise NoFlow(str(error)) from error
        if not np.isfinite(motion.a).all():
            raise NoFlow("the acceleration is not finite")
        return motion

    def _force_slope(self, x: Array) -> Array:
        """Return the derivative of the forces by the state, (n, n_x)."""
        slope = self.forces.of_x.copy()
        for at, per_state in self._learned:
            slope += float(x[at]) * per_state
            slope[:, at] += per_state.dot(x)
        return slope

    def _integrate(self, A: Array, Q: Array, dt: float) -> tuple[Array, Array, Array, Array]:
        """Return transition, its integral, noise, and the integral over what accelerometers average."""
        integrals = ExponentialIntegrals(A, Q)
        E, integral, noise = integrals.at(dt)
        is_shorter = dt <= self._averaging
        return E, integral, noise, integral if is_shorter else integrals.at(self._averaging)[1]

    def _derivative(self, x: Array, motion: Motion) -> Array:
        n = self._n
        derivative: Array = self._A.dot(x)
        derivative[n : 2 * n] = motion.xi_ddot
        return derivative
