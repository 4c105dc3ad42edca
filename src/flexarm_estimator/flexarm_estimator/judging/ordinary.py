"""The instants that make up a day: every sensor spoke once, and nothing speaks against what it said.

Gate and memory of all of them are one call of machine code (``ordinary.c``), with the bits that Python gives.
Everything else, and everything where there is no compiler, takes the way through ``gate`` and ``short_term``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path

from flexarm_estimator.judging import short_term
from flexarm_estimator.judging.scan import Scan
from flexarm_estimator.judging.short_term import ShortTerm
from flexarm_estimator.steps.joint_step import PreparedStep
from flexarm_estimator.watches import mean_shift
from flexarm_model.numeric.machine_code import load_code

SOURCE = Path(__file__).with_name("ordinary.c")


class _Rules(ctypes.Structure):
    """``struct rules`` of the C file."""

    _fields_ = (
        ("early", ctypes.c_int64),
        *((name, ctypes.c_double) for name in ("fast", "slow", "factor", "outlier2", "quiet")),
        *((name, ctypes.c_double) for name in ("memory", "most", "usual_min")),
    )


class _Instant(ctypes.Structure):
    """``struct instant`` of the C file."""

    _fields_ = (
        *(("rules", _Rules), ("sensors", ctypes.c_int64), ("memories", ctypes.c_void_p)),
        ("t", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("nu", "nis", "y", "z")),
    )


class Ordinary:
    """Judges and remembers the ordinary samples of some sensors that speak together."""

    def __init__(self, pasts: Sequence[ShortTerm], code: ctypes.PyDLL) -> None:
        """Bind the memories of the sensors, in the order of their rows."""
        self._pasts, count = pasts, len(pasts)  # the addresses below are theirs
        rules = _Rules(
            mean_shift.EARLY, mean_shift.FAST, mean_shift.SLOW, mean_shift.FACTOR, mean_shift.OUTLIER2,
            mean_shift.QUIET, short_term.MEMORY, short_term.MOST, short_term.USUAL_MIN,
        )  # fmt: skip
        self._memories = (ctypes.c_void_p * count)(*(ctypes.addressof(past.record) for past in pasts))
        self._z = (ctypes.c_double * count)()
        self._instant = _Instant(rules, count, ctypes.addressof(self._memories))
        self._instant.z = ctypes.addressof(self._z)
        self._argument = ctypes.c_void_p(ctypes.addressof(self._instant))
        self._take, self._meet = code.flexarm_take_ordinary, code.flexarm_meet
        self._take.restype = self._meet.restype = ctypes.c_int64

    def meet(self, scan: Scan) -> bool:
        """Compare a scan of the sensors with what they said before, as ``ShortTerm.meet`` does.

        Returns:
            Whether all are new, and were before; False, with nothing changed, if one wants a closer look.
        """
        self._instant.t = scan.t
        return bool(self._meet(self._argument, scan.data))

    def take(self, step: PreparedStep, t: float) -> list[float] | None:
        """Judge what the run of a step has left; return the normalised innovations if all are ordinary.

        Args:
            step: Its innovations; rows of all sensors and of no other.
            t: Stamp [s].

        Returns:
            ``sqrt(nu' S^-1 nu / m)`` of every sensor; None, with nothing changed, if one wants a closer look.
        """
        instant = self._instant
        instant.t = t
        instant.nu, instant.nis, instant.y = step.addresses
        return self._z[:] if self._take(self._argument) else None


def load_ordinary() -> ctypes.PyDLL | None:
    """Return the machine code; None where there is no working compiler."""
    return load_code(SOURCE)
