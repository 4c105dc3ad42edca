"""What a run is read back as: deviations of the modes stand behind those of the axes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from flexarm_bringup.bags.run_bag import _sigma


def test_deviations_of_modes_are_those_of_the_modes() -> None:
    """x = [theta; eta; theta'; eta'; d]: two axes and three modes."""
    variance = np.arange(1.0, 13.0) ** 2
    msg = SimpleNamespace(theta=[0.0] * 2, eta=[0.0] * 3, covariance=np.diag(variance).ravel().tolist())
    np.testing.assert_array_equal(_sigma(msg), [3.0, 4.0, 5.0])
