"""What counts of a run that began anew on the way: a pause, a clock set back, a user."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from flexarm_bringup.consistency.settled import SETTLING, beginnings, is_settled
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.intervention import Intervention
from flexarm_estimator.interventions.reset import Reset
from flexarm_estimator.interventions.set_noise import SetNoise
from flexarm_estimator.interventions.set_state import SetState
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

RUN = np.arange(100) * 0.005  # s
SOUND = len(RUN) - round(SETTLING / 0.005)
AT_REST = SetState(theta=(0.0,), theta_sigma=(1e-4,))


@cache
def arm() -> tuple[ReducedTree, object]:
    tree = ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False)
    return tree, linearize(tree)


def run(times: np.ndarray, done: Intervention | None = None, before: int = -1) -> list[Estimate]:
    """Return what an estimator says of an arm at rest at instants [s]; a user may do something to it."""
    tree, model = arm()
    estimator = Estimator(model, tree, tree.config.sensors, EstimatorConfig())
    told = []
    for k, t in enumerate(times.tolist()):
        if k == before and done is not None:
            done.check(estimator)
            done.apply(estimator)
        told.append(estimator.step([Measurement("encoder", t, np.zeros(1))], np.zeros(1), t))
    return told


def counted(*parts: np.ndarray) -> list[int]:
    """Return how many instants of every part count."""
    return [int(part.sum()) for part in np.split(is_settled(run(np.concatenate(parts))), len(parts))]


def test_after_a_pause_and_where_time_goes_back_the_filter_settles_again() -> None:
    """Two runs in one bag: of the second one, whose stamps were before, nothing counted, without a word."""
    assert counted(RUN) == [SOUND]
    assert counted(RUN, RUN + 5.0) == counted(RUN + 5.0, RUN) == [SOUND, SOUND]
    assert counted(RUN, RUN + 0.5) == [SOUND, len(RUN)]  # goes on at once
    assert list(beginnings([0.0, 0.1, 0.1, 0.25, 0.2], 0.1)) == [0, 3, 4]


@pytest.mark.parametrize("done", [Reset(), AT_REST])
def test_it_settles_again_where_a_user_resets_it_or_sets_its_state(done: Intervention) -> None:
    """One reset made a told sigma of 56 um one of 1239 um."""
    counts = is_settled(run(np.arange(200) * 0.005, done, before=100))
    assert abs([int(part.sum()) for part in np.split(counts, 2)] - np.array(SOUND)).max() <= 1


@pytest.mark.parametrize("done", [ToggleSensor("camera", False), SetNoise("encoder", (1e-4,))])
def test_it_goes_on_where_a_user_switches_a_sensor_or_sets_a_noise(done: Intervention) -> None:
    assert is_settled(run(np.arange(200) * 0.005, done, before=100))[100:].all()


def test_of_a_run_that_never_settles_nothing_counts() -> None:
    young = [SimpleNamespace(age=age) for age in (0.0, 0.1, 0.2)]
    assert not is_settled(young).any() and not is_settled([]).size
