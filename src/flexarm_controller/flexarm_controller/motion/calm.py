"""A trajectory slowed down as a whole until its strains are within the limits.

They do not fall steadily with the factor of its time: accelerations do, with its square, but a ramp that
takes longer may stir a mode more, and one that ends may double what one before left. So the factor grows step
by step until nothing is beyond a limit, and what the last step went too far is found by halves.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexarm_controller.motion.excess import Excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.stretch import slow_down
from flexarm_controller.reference import Reference

STEP = 1.02  # of the factor, at least: the ring of a motion is another after a tenth of a period
GROWTH = 0.125  # of what has been added, at least: steps from 1 to 10 are two dozen
CLOSE = 0.01  # of the factor: tries take milliseconds each, and the guard may be waiting


def calm(
    reference: Reference, beyond: Callable[[Reference], Excess | None], longest: float, spent: float = 1.0
) -> tuple[Reference, float]:
    """Return the trajectory with nothing beyond a limit, beginning when it did, and the factor of its time.

    Args:
        reference: Asked for.
        beyond: What a trajectory has beyond a limit; None: nothing.
        longest: Factor above which the trajectory is refused [1].
        spent: Of it, what the trajectory has been slowed down by already [1].

    Raises:
        MotionError: It takes too long.
    """
    low = high = 1.0
    most = max(longest / spent, 1.0)
    while (excess := beyond(slow_down(reference, high))) is not None:
        if high >= most:
            raise MotionError(f"it would take more than {longest:g} times its time: {excess}")
        step = max(STEP, 1.0 + GROWTH * (high - 1.0), float(np.sqrt(abs(excess.value / excess.limit))))
        low, high = high, min(step * high, most)
    while high - low > CLOSE * low:
        middle = (low + high) / 2.0
        low, high = (low, middle) if beyond(slow_down(reference, middle)) is None else (middle, high)
    return (reference if high == 1.0 else slow_down(reference, high)), high
