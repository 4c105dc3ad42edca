"""Normal modes and damped poles of ``M u'' + D u' + K u = f``.

Normal modes are mass-normalised and see only the diagonal of the damping::

    K Phi = M Phi W^2        Phi' M Phi = 1        damping = diag(Phi' D Phi) = 2 zeta omega

The poles see all of it: ``det(lambda^2 M + lambda D + K) = 0``, and an oscillation has
``omega = |lambda|``, ``zeta = -Re(lambda) / |lambda|``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.reduction import mode_basis
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Modes:
    """Mass-normalised normal modes, slowest first.

    Attributes:
        omega: Angular frequencies [rad/s], (r,); 0 for a rigid motion.
        damping: Modal damping ``2 zeta omega`` [1/s], (r,).
        shapes: A column per mode [kg^-1/2 for displacements], (n, r).
    """

    omega: Array
    damping: Array
    shapes: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)

    @property
    def f_hz(self) -> Array:
        """Frequencies [Hz], (r,)."""
        return self.omega / (2 * np.pi)

    @property
    def zeta(self) -> Array:
        """Damping ratios [1], (r,); 0 for a rigid motion, which has none."""
        elastic = self.omega > 0.0
        return np.where(elastic, self.damping / (2 * np.where(elastic, self.omega, 1.0)), 0.0)

    def first(self, r: int) -> Modes:
        """Return the ``r`` slowest modes.

        Raises:
            ValueError: There are fewer.
        """
        if not 1 <= r <= self.omega.size:
            raise ValueError(f"{r} modes asked for, 1 to {self.omega.size} exist")
        return Modes(self.omega[:r], self.damping[:r], self.shapes[:, :r])


def normal_modes(M: Array, D: Array, K: Array) -> Modes:
    """Return the normal modes, slowest first.

    Args:
        M: Mass, symmetric and positive definite, (n, n).
        D: Damping, (n, n).
        K: Stiffness, symmetric, (n, n).
    """
    shapes, omega = mode_basis(M, K, np.eye(M.shape[0]), M.shape[0])
    return Modes(omega, np.einsum("ir,ij,jr->r", shapes, D, shapes), shapes)


def model_modes(model: ReducedModel, locked: bool = True) -> Modes:
    """Return the modes of a served model in its coordinates ``xi``, (n, r).

    Args:
        model: The served model.
        locked: Actuated axes held (r = n_eta), or free to recoil without torque (r = n).
    """
    if not locked:
        return normal_modes(model.M, model.D, model.K)
    return Modes(model.omega, 2 * model.zeta * model.omega, np.eye(model.n)[:, model.n_theta :])


def damped_poles(M: Array, D: Array, K: Array) -> Complex:
    """Return the poles in the upper half plane, the real ones included, by magnitude [rad/s], (p,).

    n oscillations give n poles; a coordinate that is damped beyond oscillation gives two real ones.
    """
    n = M.shape[0]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    poles = np.linalg.eigvals(A)
    poles = poles[poles.imag >= 0.0]
    return np.asarray(poles[np.argsort(abs(poles), kind="stable")], dtype=complex)


def frequency_and_damping(poles: Complex) -> tuple[Array, Array]:
    """Return ``|lambda| / 2 pi`` [Hz] and ``-Re(lambda) / |lambda|`` [1] of poles, (r,) each."""
    size = abs(poles)
    return np.asarray(size / (2 * np.pi)), -poles.real / np.where(size > 0.0, size, 1.0)


def poles_of(f_hz: Array, zeta: Array) -> Complex:
    """Return the poles in the upper half plane of frequencies [Hz] and damping ratios below 1, (r,)."""
    omega, zeta = 2 * np.pi * np.asarray(f_hz, dtype=float), np.asarray(zeta, dtype=float)
    return np.asarray(omega * (-zeta + 1j * np.sqrt(1 - zeta**2)))
