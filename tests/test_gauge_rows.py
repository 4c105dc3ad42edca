"""The strain that the controller limits is the one that the estimator reads: the same rows, on every arm."""

from dataclasses import replace

import numpy as np
import pytest

from flexarm_controller.limits import limits_of
from flexarm_controller.program.soft_outputs import build_soft_outputs
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.state.sensors import LinearRows
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.state_space import state_space
from flexarm_model.tree.reduced_tree import ReducedTree

ARMS = [
    ("single_link", "geared"),
    pytest.param("planar_3rrr", "geared", marks=pytest.mark.slow),
    pytest.param("spatial_3tpt", "sim", marks=pytest.mark.slow),
    pytest.param("serial_6r", "", marks=pytest.mark.slow),
    pytest.param("variable_stiffness", "", marks=pytest.mark.slow),
]
MARGIN = 0.2


@pytest.mark.parametrize(("name", "preset"), ARMS)
def test_the_controller_limits_the_rows_that_the_estimator_reads_its_gauges_with(name, preset):
    config = load_config(find_manipulator(name), preset)
    model = linearize(ReducedTree(config))
    limits = limits_of(config)
    limits = replace(limits, strain=np.minimum(limits.strain, 0.01))  # gauges without a limit too
    soft = build_soft_outputs(model, limits, MpcConfig(strain_margin=MARGIN))
    system = state_space(model, np.ones(model.n))
    gauges = [spec for spec in config.sensors if spec.kind == "strain_gauge"]
    read = [LinearRows(spec, model, system) for spec in gauges]
    mine = [i for i, row in enumerate(soft.names) if row.startswith("strain:")]
    bound = limits.strain * (1 - MARGIN)
    assert [soft.names[i] for i in mine] == [f"strain:{gauge}" for gauge in limits.gauges]
    if gauges:
        C = np.vstack([rows.C for rows in read])
        np.testing.assert_allclose(soft.C[mine] * bound[:, None], C, rtol=1e-12, atol=1e-15 * abs(C).max())
        at_zero = np.concatenate([rows.D[:, -1] for rows in read])
        np.testing.assert_allclose(soft.y_0[mine] * bound, at_zero, rtol=1e-12, atol=1e-15)
        assert not any(rows.D[:, :-1].any() for rows in read)  # no torque is felt at once
