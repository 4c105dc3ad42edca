"""Whether a bag holds one session: what two of them tell does not belong together."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexarm_bringup.identify.measurement import SourceError

BACK = 0.1  # s that a message may be late
BETWEEN = 5.0  # s without joint states, or more: another session, or a clock that was set


def passed(path: Path, t: float, newest: float) -> float:
    """Return the newest stamp of the joint states so far [s].

    Args:
        path: Of the bag.
        t: The one that comes now [s].
        newest: The newest before; -inf for none [s].

    Raises:
        SourceError: The one that comes now is much older, or much newer.
    """
    goes_back = t < newest - BACK
    if goes_back or (t > newest + BETWEEN and np.isfinite(newest)):
        raise SourceError(
            f"{path}: stamps of joint_states {'go back' if goes_back else 'jump'} from {newest:.3f} to "
            f"{t:.3f} s: two sessions in one bag, or a clock that jumped; expected one session"
        )
    return max(t, newest)
