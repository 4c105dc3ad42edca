"""Process model: how the state moves between two instants, and how sure that is.

``x = [theta; eta; theta'; eta'; d; b; w; s; p]``, ``d`` an unmodelled torque, ``b`` biases of sensors
(``bias_states``), ``w`` and ``s`` how the arm sags (``sag``), ``p`` what is learned of it (``stiffness``).
Three more things are unknown of it, each written as a physical setting (``EstimatorConfig``):

* white torque on the axes: ``acceleration_noise`` times their inertia;
* forces on the modes. A relative error ``e`` of frequency acts as a force ``2 e omega^2 eta``; with
  ``eta`` of the size that an axis acceleration ``a`` excites, ``|M_et| a / omega^2``, this is
  ``2 e |M_et| a``. It is narrow-banded about ``omega``; its white stand-in has intensity
  ``2 sigma^2 / omega``. Without it a light hub goes unstable through mode 2 (seed 002, section 6);
* drift of ``d`` (friction, payload, gravity error): a random walk.

Accelerometers feel the same force noise. A reading averages it over ``T = force_averaging``, so it has the
covariance ``S/T`` where S is its intensity. With the noise of a step of length dt its covariance is
``I(min(dt, T)) G S/T``, ``I(t) = int_0^t e^{A s} ds``: only the time counts that step and average share.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.biases.bias_states import bias_states, with_biases
from flexarm_estimator.judging.reopening import Reopening, widen
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.sag import sag_states, with_sag
from flexarm_estimator.state.state_layout import StateLayout
from flexarm_estimator.state.stiffness import FAR, learned_modes, stiffness_sigma, with_stiffness
from flexarm_estimator.steps.bilinear import Slope, tangent
from flexarm_estimator.steps.taylor import ExponentialIntegrals, IntegralSlopes
from flexarm_model.manipulator.sensor_spec import BiasSpec
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace, state_space
from flexarm_model.tree.borne_load import BorneLoad

Array = NDArray[np.float64]
CACHE_SIZE = 128  # periods; a camera by a clock of its own makes new ones with every frame
_NS_PER_S = 1e9
_UNCOUPLED = 0.1  # coupling assumed of modes that the axes do not move [kg^0.5 m/rad]


@dataclass(frozen=True)
class Transition:
    """One step of the state: ``x+ = A x + B [tau; 1] + sum p_i (A_i x + B_i [tau; 1]) + w``.

    Attributes:
        dt: Length of the step, rounded to 1 ns [s].
        A: (n_x, n_x).
        B: Torque and constant drift, (n_x, n_u + 1).
        Q: Covariance of w, (n_x, n_x).
        force_cross: Covariance of w with the averaged force noise, (n_x, n).
        slopes: What one unit of every learned parameter adds to A and B.
    """

    dt: float
    A: Array
    B: Array
    Q: Array
    force_cross: Array
    slopes: tuple[Slope, ...] = ()

    def at(self, x: Array, u: Array) -> Transition:
        """Return the tangent at the state x (n_x,) before the step and the inputs u (n_u + 1,)."""
        if not self.slopes:
            return self
        A, B = tangent(self.A, self.B, self.slopes, (x, u))
        return Transition(self.dt, A, B, self.Q, self.force_cross)


class ProcessModel:
    """Discrete steps of a reduced model of any length, and its initial covariance.

    Attributes:
        layout: Where things stand in the state.
        system: Continuous state space.
        force_cov: Covariance of the force noise averaged over ``force_averaging``, (n, n).
        P0: Covariance at the start, (n_x, n_x).
        sag: How the states w and s move.
        biases: States of the sensors' biases by name, in their order.
        learned: What one unit of every learned parameter adds to x' per state, (n_x, n_x) each.
        limits: By place in the state, what a bias or learned parameter is held within.
    """

    def __init__(
        self,
        model: ReducedModel,
        config: EstimatorConfig,
        biases: Mapping[str, BiasSpec] | None = None,
        borne: BorneLoad | None = None,
    ) -> None:
        """Prepare the steps; the work is done once per model.

        Args:
            model: Served model.
            config: Settings.
            biases: Output rows "sensor.channel" that have a bias; none if None.
            borne: What springs and bodies bear at the model's pose; None for nothing.
        """
        n, n_theta = model.n, model.n_theta
        self.biases = bias_states(biases or {})
        self.sag, sigma_p = sag_states(model, config, borne), stiffness_sigma(config, model)
        learned, n_w, n_s = min(config.stiffness_modes, model.n_eta), self.sag.n_w, self.sag.n_s
        self.layout = StateLayout(n, n_theta, tuple(self.biases), n_w, n_s, sigma_p.size, learned)
        inertia = np.diag(model.M)[:n_theta]
        modal_force = _modal_force(model, config)
        torque_psd = (config.acceleration_noise * inertia) ** 2
        force_psd = np.concatenate([torque_psd, 2.0 * modal_force**2 / model.omega])
        arm = state_space(model, force_psd, (config.disturbance_drift * inertia) ** 2)
        biased = with_biases(arm, model.outputs.names, self.biases)
        self.system: StateSpace = with_stiffness(with_sag(biased, model, self.sag), model, config)
        self._averaging = config.force_averaging
        self.force_cov = np.diag(force_psd) / self._averaging
        self._G = np.zeros((self.system.n_x, n))
        self._G[n : 2 * n] = np.linalg.inv(model.M)  # small and well conditioned by construction
        self._held = np.column_stack([self.system.B, self.system.c])
        self._integrals = ExponentialIntegrals(self.system.A, self.system.Q)
        self.learned = tuple([self._G.dot(force) for force in self.system.learned])
        self._slopes = [IntegralSlopes(self.system.A, rate) for rate in self.learned]
        self._cache: dict[int, Transition] = {}
        sigma_b = [state.sigma for state in self.biases.values()]
        known = np.concatenate([_initial_sigma(model, config, inertia), sigma_b])
        self.P0 = block_diagonal(np.diag(known**2), self.sag.P0, np.diag(sigma_p**2))
        self._sigma, self._disturbance = np.sqrt(np.diag(self.P0)), config.initial_disturbance
        self.limits = {
            **dict(enumerate((state.limit for state in self.biases.values()), self.layout.b.start)),
            **dict(enumerate((FAR * sigma_p).tolist(), self.layout.p.start)),
        }

    def widen(self, reopening: Reopening) -> Array:
        """Return what is added to the covariance when the state is doubted, (n_x, n_x)."""
        return widen(reopening, self._sigma, self.layout, self._disturbance)

    def step(self, dt: float) -> Transition:
        """Return the step over ``dt`` > 0 seconds; equal periods (to 1 ns) are computed once."""
        key = max(1, round(dt * _NS_PER_S))
        found = self._cache.get(key)
        if found is None:
            if len(self._cache) >= CACHE_SIZE:
                self._cache.clear()
            found = self._cache[key] = self._compute(key / _NS_PER_S)
        return found

    def pushed(self, dt: float) -> Array:
        """Return what accelerations of xi held over ``dt`` [s] add to the state, (n_x, n)."""
        pushed: Array = self._integrals.at(dt)[1][:, self.layout.n : 2 * self.layout.n]
        return pushed

    def _compute(self, dt: float) -> Transition:
        E, integral, Q = self._integrals.at(dt)
        overlap = integral if dt <= self._averaging else self._integrals.at(self._averaging)[1]
        slopes = [Slope(dE, dI.dot(self._held)) for dE, dI in (slope.at(dt) for slope in self._slopes)]
        cross = overlap.dot(self._G).dot(self.force_cov)
        return Transition(dt, E, integral.dot(self._held), Q, cross, tuple(slopes))


def _modal_force(model: ReducedModel, config: EstimatorConfig) -> Array:
    """One sigma of the force on every mode [kg^0.5 m/s^2], (n_eta,)."""
    coupling = np.abs(model.M[model.n_theta :, : model.n_theta]).sum(axis=1)
    excited = 2.0 * config.frequency_error * coupling * config.motion_acceleration
    force = np.asarray(np.hypot(excited, config.modal_force))
    force[learned_modes(model, config)] *= config.stiffness_rest
    return force


def _initial_sigma(model: ReducedModel, config: EstimatorConfig, inertia: Array) -> Array:
    """One sigma of every state but biases, sag and what is learned at the start, (2 n + n_theta,)."""
    coupling = np.abs(model.M[model.n_theta :, : model.n_theta]).sum(axis=1)
    eta_dot = (coupling + _UNCOUPLED) * config.initial_velocity  # an axis that stops at once leaves M_et v
    position = np.full(model.n_theta, config.initial_position)
    velocity = np.full(model.n_theta, config.initial_velocity)
    disturbance = config.initial_disturbance * inertia
    return np.concatenate([position, eta_dot / model.omega, velocity, eta_dot, disturbance])
