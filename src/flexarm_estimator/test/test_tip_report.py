"""Where the tip cannot be placed the last one stands, but the state is that of now."""

import numpy as np
from planar_strip import SENSORS, StripKinematics, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.tool.report import TipReporter


def test_a_tip_that_cannot_be_placed_leaves_the_last_one_beside_the_state_of_now():
    parts = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig()).past[0]
    n_x, reporter = parts.layout.n_x, TipReporter()
    x, P = np.full(n_x, 0.01), np.eye(n_x)
    first, doubt = reporter.describe(parts.tip, Belief(x, P))
    assert doubt == ""
    x += 1.0  # a report keeps what it was seen from
    assert (first.x == 0.01).all()
    wild = Belief(np.full(n_x, 0.5), np.full((n_x, n_x), np.inf))
    with np.errstate(invalid="ignore"):
        last, doubt = reporter.describe(parts.tip, wild)
    assert "cannot be placed" in doubt
    np.testing.assert_array_equal(last.T_world_tip, first.T_world_tip)
    np.testing.assert_array_equal(last.x, wild.x)
    np.testing.assert_array_equal(last.P, wild.P)
    assert not (last.x.flags.writeable or last.P.flags.writeable)
