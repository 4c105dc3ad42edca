"""What counts of a run that began anew on the way: after a pause, and where a clock was set back."""

import numpy as np

from flexarm_bringup.consistency.settled import SETTLING, beginnings, is_settled
from flexarm_estimator.settings import EstimatorConfig

RUN = np.arange(100) * 0.005  # s
LEFT_OUT = round(SETTLING / 0.005)


def counted(*runs: np.ndarray) -> list[int]:
    """Return how many instants of every run count."""
    settled = is_settled(np.concatenate(runs).tolist(), EstimatorConfig())
    return [int(part.sum()) for part in np.split(settled, len(runs))]


def test_after_a_pause_and_where_time_goes_back_the_filter_settles_again() -> None:
    """Two runs in one bag: of the second one, whose stamps were before, nothing counted, without a word."""
    sound = len(RUN) - LEFT_OUT
    assert counted(RUN) == [sound]
    assert counted(RUN, RUN + 5.0) == counted(RUN + 5.0, RUN) == [sound, sound]
    assert counted(RUN, RUN + 0.5) == [sound, len(RUN)]  # goes on at once
    assert list(beginnings([0.0, 0.1, 0.1, 0.25, 0.2], 0.1)) == [0, 3, 4]


def test_of_a_run_that_never_settles_nothing_counts() -> None:
    assert (
        not is_settled([0.0, 0.1, 0.2], EstimatorConfig()).any()
        and not is_settled([], EstimatorConfig()).size
    )
