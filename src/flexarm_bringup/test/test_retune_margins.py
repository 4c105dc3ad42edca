"""What retuning gives up so that margins are kept."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flexarm_bringup.retune.roll_off import keep_margins
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

pytestmark = pytest.mark.slow


def test_an_arm_that_must_not_be_firm_keeps_its_weights_and_is_soft() -> None:
    """The light hub: its ordinary weights keep every margin, the gate refuses only the firm ones."""
    config, task = load_config(find_manipulator("single_link"), "light_hub"), task_for("single_link")
    task = task.under("light_hub")
    mpc = replace(task.make("mpc", MpcConfig), time_limit=0.0, firm_time=0.4)
    estimator, law = task.make("estimator", EstimatorConfig), task.make("controller", ControllerConfig)
    kept = keep_margins(config, estimator, (law, mpc), [config.home])
    assert kept.mpc == replace(mpc, firm_time=0.0)
    assert (kept.tries, kept.trouble, len(kept.poses)) == (0, "", 1)


def test_where_no_weights_help_they_stay_and_the_trouble_is_told() -> None:
    """A filter that is far too sure of itself makes mode 2 grow under weaker weights, too."""
    config = load_config(find_manipulator("single_link"), "light_hub")
    estimator = EstimatorConfig(modal_force=1e-3, frequency_error=0.1, acceleration_noise=0.03)
    law, mpc = ControllerConfig(), MpcConfig(time_limit=0.0)
    kept = keep_margins(config, estimator, (law, mpc), [config.home])
    assert "mode 2 is unstable" in kept.trouble
    assert (kept.mpc, kept.tries, kept.poses) == (mpc, 0, ())
