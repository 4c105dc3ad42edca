"""The camera of the simulated rig says that it is steadily off where an encoder's zero is, and never else."""

import numpy as np
import pytest
from test_isolation_rig import arm, plant

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_bringup.sim_run.conditions import CONDITIONS
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_estimator.watches import offset_watch

OFF = [
    ("planar_3rrr", "encoder_2", 5e-3),
    ("spatial_3tpt", "encoder_1", 2e-3),
]
SOUND = {**CONDITIONS, "mass +50 %": RigSettings(body_mass_scale=1.5)}
END = 5.0  # s: blocks of a move and of rest


def remarks(name, rig=RigSettings(), faults=None):  # noqa: B008, frozen
    """Return what is said of steady offsets in a run under joint PD: {sensor: reason}."""
    it, said = arm(name), {}

    def observe(hardware, estimate):
        said.update({r.name: r.reason for r in estimate.sensors if "all the time" in r.reason})
        return {}

    hardware = Hardware(it.tree.config, rig, plant=plant(it.task.manipulator, rig), faults=faults)
    run_loop(hardware, it.tree, it.course.reference, END, loop_settings(it.task, "pd", rig), observe)
    return said


@pytest.mark.slow
def test_a_wrong_zero_of_a_link_that_is_weighed_costs_the_tip_nothing():
    """Until its gauges had a bias they sided with the encoder: the tracker was said to be off."""
    errors = []
    for off in (0.0, 5e-4):
        it, apart = arm("serial_6r"), []

        def observe(hardware, estimate, apart=apart):
            apart.append(np.linalg.norm(estimate.T_world_tip[:3, 3] - hardware.rig.truth().tip[:3]))
            assert estimate.t < 1.0 or estimate.status == "ok"
            return {}

        rig = RigSettings()
        faults = {"encoder_2": SensorFault("bias", 0.0, bias=off)}
        hardware = Hardware(it.tree.config, rig, plant=plant(it.task.manipulator, rig), faults=faults)
        run_loop(hardware, it.tree, it.course.reference, END, loop_settings(it.task, "pd", rig), observe)
        errors.append(float(np.sqrt(np.mean(np.square(apart[500:])))))
    print(f"\n{1e6 * errors[0]:.1f} um, with the zero off {1e6 * errors[1]:.1f} um")
    assert errors[1] < 1.1 * errors[0] < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(("name", "encoder", "off"), OFF)
def test_a_wrong_zero_of_an_encoder_is_seen_by_the_camera(name, encoder, off):
    said = remarks(name, faults={encoder: SensorFault("bias", 0.0, bias=off)})
    assert len(said) == 1
    assert set(said) <= {"camera", "tracker"}


@pytest.mark.slow
@pytest.mark.parametrize("condition", SOUND)
@pytest.mark.parametrize(
    "name", ["single_link", "planar_3rrr", "spatial_3tpt", "serial_6r", "variable_stiffness"]
)
def test_a_sound_camera_is_not_said_to_be_off_whatever_the_arm_weighs(name, condition, monkeypatch):
    largest, judge = [0.0], offset_watch._judge

    def noting(model, means):
        largest.append(float(np.abs(means.steady() / np.sqrt(model.R.diagonal())).max()))
        return judge(model, means)

    monkeypatch.setattr(offset_watch, "_judge", noting)
    assert remarks(name, SOUND[condition]) == {}
    print(f"{name}, {condition}: {max(largest):.2f} sigma")
    assert max(largest) < 0.7
