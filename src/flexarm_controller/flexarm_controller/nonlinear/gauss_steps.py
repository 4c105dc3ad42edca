"""A control period of the arm by one Gauss-Legendre step of fourth order, with exact derivatives.

Accelerations ``a_i`` of the two stages solve, with ``c, A, b`` of the scheme [Hairer2006, table 1.1]::

    force(y_i, w_i, a_i) = [u; 0]      y_i = y + h c_i w + h^2 (A A a)_i      w_i = w + h (A a)_i
    y+ = y + h w + h^2 b' A a          w+ = w + h b' a                        s = [y; w]

One Newton step about a guess of the accelerations gives ``s+ = A_k s + B_k u + r_k``: by the implicit
function theorem the derivatives of the step are those of its converged equations where the guess is right.
The step is stable for every frequency and damping (no substeps; a mode of the frequency ``omega`` is
``(omega h)^4 / 720`` slow) and conserves the energy of a linear arm.
"""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.nonlinear.arm_equations import ArmEquations, NonlinearModelError
from flexarm_model.numeric.machine_code import MachineCode, load_code

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("gauss_steps.c")
ITERATIONS = 20
TOLERANCE = 1e-11  # last change of an acceleration or coordinate, by the largest of them or 1


class _Layout(ctypes.Structure):
    """``struct arm`` of the C file."""

    _fields_ = [
        ("n", ctypes.c_int64),
        ("n_u", ctypes.c_int64),
        ("h", ctypes.c_double),
        ("forces", ctypes.c_void_p),
        ("work", ctypes.c_void_p),
    ]


class GaussSteps:
    """Integrator of one arm at one period.

    Attributes:
        n: Number of coordinates.
        n_u: Number of actuated axes.
        h: Period [s].
    """

    def __init__(self, arm: ArmEquations, h: float) -> None:
        """Bind the equations for the period ``h`` [s].

        Raises:
            NonlinearModelError: There is no working C compiler.
        """
        code = None if arm.force.library is None else load_code(SOURCE)
        if code is None:
            raise NonlinearModelError("law 'nmpc' needs a C compiler (gcc or cc), and there is none")
        self.n, self.n_u, self.h = arm.n, arm.n_u, h
        self._forces, self._code = MachineCode(arm.force), code
        self._work = np.zeros(2 * arm.n * (2 * arm.n + 1) + 3 * arm.n)
        self._layout = _Layout(arm.n, arm.n_u, h, self._forces.address, address(self._work))
        self._at = ctypes.c_void_p(ctypes.addressof(self._layout))
        for call in (code.flexarm_linearize_periods, code.flexarm_advance_period, code.flexarm_rest):
            call.restype = ctypes.c_int64

    def linearize(self, points: Points, periods: Periods) -> bool:
        """Fill ``periods`` about ``points``; returns whether it could."""
        count = ctypes.c_int64(len(points.s))
        return bool(self._code.flexarm_linearize_periods(self._at, count, *points.places, *periods.places))

    def advance(self, s: Array, u: Array, a: Array, share: float = 1.0) -> bool:
        """Advance ``s`` (n_x,) in place under the torque u (n_u,).

        Args:
            s: State.
            u: Torque, held over the period [N m or N].
            a: First guess of the accelerations of the stages, which they become, (2 n,).
            share: Share of the period to go [1].

        Returns:
            Whether Newton's iteration settled; else ``s`` is unchanged.
        """
        u = np.ascontiguousarray(u, dtype=np.float64)
        h = ctypes.c_double(share * self.h)
        return bool(self._code.flexarm_advance_period(self._at, h, *places(s, u, a), *_STOP))

    def rest(self, reference: Array, s: Array, u: Array) -> bool:
        """Find states without vibration: coordinates that no axis drives stand still in equilibrium.

        Args:
            reference: ``[theta; theta'; theta'']``, (k, 3 n_u).
            s: States, (k, n_x), filled; undriven coordinates are the first guess.
            u: Their torques, (k, n_u), filled.

        Returns:
            Whether Newton's iteration settled.
        """
        count = ctypes.c_int64(len(s))
        return bool(self._code.flexarm_rest(self._at, count, *places(reference, s, u), *_STOP))


class Points:
    """Where periods are linearised; the arrays are filled in place, never replaced.

    Attributes:
        s: States at their beginnings, (N, n_x).
        u: Torques on the axes, unmodelled ones included, (N, n_u).
        a: Accelerations of the stages, (N, 2 n).
        places: Where they are, for C.
    """

    def __init__(self, steps: GaussSteps, N: int) -> None:
        """Make room for ``N`` periods."""
        self.s, self.u = np.zeros((N, 2 * steps.n)), np.zeros((N, steps.n_u))
        self.a = np.zeros((N, 2 * steps.n))
        self.places = places(self.s, self.u, self.a)


class Periods:
    """Linearised periods ``s+ = A s + B u + r``; the arrays are filled in place, never replaced.

    Attributes:
        A: (N, n_x, n_x).
        B: (N, n_x, n_u).
        r: (N, n_x).
        X: Accelerations change by ``-X [1; change of s; change of u]``, (N, 2 n, 1 + n_x + n_u).
        places: Where X, A, B, r are, for C.
    """

    def __init__(self, steps: GaussSteps, N: int) -> None:
        """Make room for ``N`` periods."""
        n_x, n_u = 2 * steps.n, steps.n_u
        self.A, self.B, self.r = np.zeros((N, n_x, n_x)), np.zeros((N, n_x, n_u)), np.zeros((N, n_x))
        self.X = np.zeros((N, n_x, 1 + n_x + n_u))
        self.places = places(self.X, self.A, self.B, self.r)


def address(array: Array) -> int:
    """Return where the data of an array are."""
    return int(array.ctypes.data)


def places(*arrays: Array) -> tuple[ctypes.c_void_p, ...]:
    """Return where arrays are, as arguments for C."""
    return tuple(ctypes.c_void_p(address(array)) for array in arrays)


_STOP = (ctypes.c_int64(ITERATIONS), ctypes.c_double(TOLERANCE))
