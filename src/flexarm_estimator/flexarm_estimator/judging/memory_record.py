"""What the next sample of a sensor is judged by, in numbers, in one place for Python and machine code."""

from __future__ import annotations

import ctypes

from flexarm_estimator.watches.mean_shift import MeanRecord

_OF_CHANNELS = ("reference", "values", "predicted", "still", "said", "step")


class MemoryRecord(ctypes.Structure):
    """What the next sample is judged by, where machine code finds it, too ("struct memory" of ordinary.c).

    ``reference``: innovation of the first of equal samples, (m,). ``values``: of the newest sample, (m,).
    ``predicted``, ``said``: of the newest that was new, (m,). ``step``: to it from the one before, (m,).
    ``still``: by how much a prediction at rest goes on, (m,). ``zigzags``: of what is said meanwhile.
    ``scanned``: samples that came in scans. ``repeats``: of the newest values, said since ``since`` [s].
    ``leaps``: samples since a leap faster than ``fastest`` [SI/s], none of which agreed with the state.
    ``held``: samples that wait. ``threshold``: of nu' S^-1 nu. ``biased``: of the score of the mean.
    ``limit``: of z, ``jump`` times what is usual. ``usual2``: mean of z^2. ``last``: z.
    """

    _fields_ = (
        ("test", ctypes.POINTER(MeanRecord)),
        *((name, ctypes.POINTER(ctypes.c_double)) for name in _OF_CHANNELS),
        *((name, ctypes.c_int64) for name in ("scanned", "repeats", "held", "zigzags", "leaps")),
        *(
            (name, ctypes.c_double)
            for name in ("since", "threshold", "biased", "jump", "limit", "usual2", "last", "fastest")
        ),
    )
