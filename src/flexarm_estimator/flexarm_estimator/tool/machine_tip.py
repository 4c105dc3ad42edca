"""The tip in machine code: one call for what takes fifty with NumPy; both give the same to rounding."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.steps.records import Records
from flexarm_estimator.tool.tip import Kinematics, PlainTip, Sight, Tip, TipReport, spread
from flexarm_model.numeric.machine_code import MachineCode, load_code
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closing import MachineClosing, code_places
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("machine_tip.c")
_POSE, _SHAPES = 16, ((4, 4), (6,), (6, 6), (6, 6))  # numbers of a pose; pose, twist and covariances


class _Layout(ctypes.Structure):
    """``struct tip`` of the C file."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("n_q", "n", "n_x")),
        *((name, ctypes.c_void_p) for name in ("origin", "Phi", "pose", "jacobian")),
        *((name, ctypes.c_void_p) for name in ("loops", "close", "follow")),
        *((name, ctypes.c_void_p) for name in ("q", "J_q", "J", "moved")),
        *((name, ctypes.c_void_p) for name in ("x", "P", "y", "placed", "nu", "record")),
        ("variance", ctypes.c_double),
    ]


class _SightLayout(ctypes.Structure):
    """``struct sight`` of the C file."""

    _fields_ = (
        *(("tip", ctypes.c_void_p), ("m", ctypes.c_int64)),
        *((name, ctypes.c_void_p) for name in ("gain", "constant", "y", "x")),
    )


class MachineTip(Tip):
    """In machine code, on fixed buffers; where that does not arrive NumPy says why.

    Attributes:
        n: Number of served coordinates.
        address: Where machine code finds it.
        seen: Position of the tip last placed [m], (3,); the next one overwrites it.
    """

    def __init__(self, model: ReducedModel, tree: ReducedTree, n_x: int, code: ctypes.PyDLL) -> None:
        """Bind the compiled kinematics to a served model and a state of ``n_x`` numbers."""
        self._plain, self.n = PlainTip(model, tree), model.n
        functions = [MachineCode(tree.functions[name]) for name in ("tip_pose", "tip_jacobian")]
        Phi = np.array(model.Phi, order="F")
        origin = model.q0 - Phi @ model.xi0
        self._x, self._P, self._placed = np.zeros(n_x), np.zeros((n_x, n_x)), np.zeros(_POSE)
        self._y, self._nu = np.zeros(6), np.zeros(6)
        self._records = Records(*_SHAPES, (n_x,), (n_x, n_x), is_read_only=True)
        self._J = np.zeros((6, model.n))
        work = np.zeros(tree.n_q), np.zeros(6 * tree.n_q), self._J, np.zeros(model.n)
        self._layout = _Layout(
            *(tree.n_q, model.n, n_x), *(array.ctypes.data for array in (origin, Phi)),
            *(function.address for function in functions), *_loops(tree),
            *(array.ctypes.data for array in (*work, self._x, self._P, self._y, self._placed, self._nu)),
        )  # fmt: skip
        self._kept = tree, functions, Phi, origin, work  # the layout has only their addresses
        self.address, self.seen = ctypes.addressof(self._layout), self._placed.reshape(4, 4)[:3, 3]
        self._at = ctypes.c_void_p(self.address)
        self._place, self._locate = code.flexarm_place_tip, code.flexarm_locate_tip
        self._describe, self._see = code.flexarm_describe_tip, code.flexarm_see_tip
        self._compare = code.flexarm_compare_pose
        for function in (self._place, self._locate, self._compare, self._describe, self._see):
            function.restype = ctypes.c_int64

    def sight(self, gain: Array, constant: Array) -> Sight:
        """See Tip."""
        return MachineSight(self, self._see, gain, constant)

    def pose(self, x: Array) -> Array:
        """See Tip."""
        self._x[:] = x
        if not self._place(self._at):
            return self._plain.pose(x)
        return self._placed.copy().reshape(4, 4)

    def locate(self, x: Array) -> tuple[Array, Array]:
        """See Tip."""
        self._x[:] = x
        if not self._locate(self._at):
            return self._plain.locate(x)
        return self._placed.copy().reshape(4, 4), self._J.copy()

    def compare(self, y: Array, x: Array) -> tuple[Array, Array]:
        """See Tip."""
        self._x[:], self._y[:] = x, y
        return (self._nu.copy(), self._J.copy()) if self._compare(self._at) else super().compare(y, x)

    def describe(self, belief: Belief) -> TipReport:
        """See Tip."""
        self._x[:], self._P[:] = belief
        layout = self._layout
        layout.record, T, twist, cov_pose, cov_twist, x, P = self._records.take()
        sigma = spread(layout.variance) if self._describe(self._at) else math.nan
        return TipReport(T, twist, cov_pose, cov_twist, sigma, x, P)


class MachineSight(Sight):
    """In machine code, on fixed buffers."""

    def __init__(
        self, tip: MachineTip, see: Callable[[ctypes.c_void_p], int], gain: Array, constant: Array
    ) -> None:
        """Bind ``flexarm_see_tip`` to the tip, gain and constant."""
        super().__init__(tip, gain, constant)
        n, m = tip.n, gain.shape[1]
        arrays = np.array(gain[:n], order="C"), np.array(constant[:n])
        self._y, self._x = (ctypes.c_double * m)(), (ctypes.c_double * n)()
        buffers = ctypes.addressof(self._y), ctypes.addressof(self._x)
        self._layout = _SightLayout(tip.address, m, *(array.ctypes.data for array in arrays), *buffers)
        self._kept = arrays  # the layout has only their addresses
        self._at = ctypes.c_void_p(ctypes.addressof(self._layout))
        self._see, self._seen = see, tip.seen

    def position(self, y: list[float]) -> Array:
        """See Sight."""
        self._y[:] = y
        return self._seen.copy() if self._see(self._at) else super().position(y)


def make_tip(model: ReducedModel, kinematics: Kinematics, n_x: int, use_compiler: bool = True) -> Tip:
    """Return the fastest tip that arm and machine allow.

    Args:
        model: Served model.
        kinematics: Of the arm.
        n_x: Number of states.
        use_compiler: False takes NumPy.
    """
    if not use_compiler or not isinstance(kinematics, ReducedTree) or not _is_compiled(kinematics):
        return PlainTip(model, kinematics)
    code = load_code(SOURCE)
    return PlainTip(model, kinematics) if code is None else MachineTip(model, kinematics, n_x, code)


def _is_compiled(tree: ReducedTree) -> bool:
    closes = not tree.n_c or isinstance(tree.closing, MachineClosing)
    return closes and all(tree.functions[name].library is not None for name in ("tip_pose", "tip_jacobian"))


def _loops(tree: ReducedTree) -> tuple[int, ...]:
    """Return the addresses of the loops and of the code that closes and follows them; zeros without loops."""
    names = "flexarm_close", "flexarm_follow_closed"
    return code_places(tree.closing, *names) if tree.n_c else (0,) * (1 + len(names))
