"""The rig's arm differs from its description also where bodies are imported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from imported_arm import write_arm

from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config


def test_an_imported_body_is_faster_and_has_more_modes_on_the_rig(tmp_path: Path) -> None:
    config = load_config(write_arm(tmp_path / "arm.yaml"))
    real = perturb(config, PlantSettings(frequency_scale=1.1, extra_modes=2)).bodies["solid"]
    described, found = (reduce_body(body, {"root"}) for body in (config.bodies["solid"], real))
    assert found.n == described.n + 2
    assert found.omega[:3] == pytest.approx(1.1 * described.omega, rel=1e-9)
    assert isinstance(real, ImportedBody)
    by_frequency = replace(real, reduction=replace(real.reduction, modes=0, f_max=5000.0))
    same = perturb(replace(config, bodies={"solid": by_frequency}), PlantSettings(extra_modes=2)).bodies[
        "solid"
    ]
    assert isinstance(same, ImportedBody) and same.reduction == by_frequency.reduction
