"""Weights of an arm that nobody has tuned: those of the defaults' arm in the time of its own slowest mode."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_arm import small_arm

from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.report import gain_db
from flexarm_bringup.sim_run.study import SimResult, run_sim_job, sim_jobs
from flexarm_bringup.tasks.task_for import task_for
from flexarm_bringup.tasks.weights_by_arm import CHOSEN_FOR_HZ, TIP_SHARE, weights_for
from flexarm_controller.settings import MpcConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

DT = 0.005
ROUNDED = 0.05  # relative: weights have two digits
PIECE = {
    "length": "240 mm",
    "section": {"shape": "rectangle", "along_y": "3 mm", "along_z": "20 mm"},
    "youngs_modulus": "200 GPa",
    "density": "7800 kg/m^3",
    "elements": 8,
}
AXIS = {
    "actuated": True, "rotor_inertia": "0.05 kg m^2", "effort": "20 N m", "effort_rate": "2 kN m/s",
    "velocity": "4 rad/s", "lower": "-60 deg", "upper": "60 deg",
}  # fmt: skip
BIAS = {"sigma": "0.3 m/s^2", "drift": "0.003 m/s^2/sqrt(s)", "limit": "2 m/s^2"}
FEEL = {"kind": "accelerometer", "node": "strip.tip", "axes": ["y"], "sigma": "0.03 m/s^2"}
SEE = {"kind": "camera", "rate": "50 Hz", "latency": "30 ms", "sigma": "0.3 mm", "sigma_angle": "2 mrad"}
STIFF: dict[str, Any] = {  # 42 Hz on a light hub, an accelerometer at its tip
    "bodies__hub": None,
    "joints__clamp": None,
    "joints__base": {"parent": "world", "child": "strip.root", "axes": {"rz": AXIS}},
    "bodies__strip__pieces": [PIECE],
    "bodies__strip__nodes": {"tip": "240 mm"},
    "sensors": {
        "encoder": {"kind": "encoder", "axis": "base.rz", "sigma": "20 urad"},
        "acc": {**FEEL, "range": "10 g", "bias": BIAS},
        "camera": SEE,
    },
    "served__rate": "500 Hz",
    "served__poses": {"up": ["-30 deg"], "down": ["30 deg"]},
}


def faster(model: ReducedModel, s: float) -> ReducedModel:
    """Return an arm of the same masses and shapes whose slowest mode is ``s`` times that of the defaults."""
    omega = model.omega * (2 * np.pi * CHOSEN_FOR_HZ * s / model.omega[0])
    return replace(model, omega=omega)


def the_strip(preset: str = "geared") -> ReducedModel:
    return linearize(ReducedTree(load_config(find_manipulator("single_link"), preset), use_compiler=False))


def test_the_arm_that_the_defaults_were_chosen_for_has_the_defaults() -> None:
    weights, chosen = weights_for(the_strip(), DT), MpcConfig()
    assert weights == {name: pytest.approx(getattr(chosen, name), rel=ROUNDED) for name in weights}
    assert {"velocity_error", "modal_energy", "input_jerk"} <= weights.keys()


@pytest.mark.parametrize(("s", "jerk"), [(4.0, 4.0), (0.5, 0.125)])
def test_weights_go_with_the_time_of_the_slowest_mode(s: float, jerk: float) -> None:
    weights, chosen = weights_for(faster(the_strip(), s), DT), MpcConfig()
    axes = max(s, 1.0) ** 0.5
    ratios = {
        "position_error": axes,
        "velocity_error": s,
        "input_acceleration": s**2,
        "input_jerk": jerk,
        "modal_cutoff_hz": s,
    }
    for name, ratio in ratios.items():
        assert weights[name] == pytest.approx(getattr(chosen, name) * ratio, rel=ROUNDED), name
    assert weights["modal_energy"] == pytest.approx(chosen.modal_energy * (s * axes) ** 2, rel=2 * ROUNDED)


def test_the_horizon_sees_half_a_period_of_the_slowest_mode() -> None:
    for s, dt in ((1.0, 0.001), (0.1, DT)):
        told = weights_for(faster(the_strip(), s), dt)
        assert told["horizon"] * dt == pytest.approx(0.5 / (s * CHOSEN_FOR_HZ), rel=0.02)  # whole periods
        assert sum(told["blocks"]) == told["horizon"] and len(told["blocks"]) == len(MpcConfig().blocks)
    assert "horizon" not in weights_for(the_strip(), DT)
    assert isinstance(told["blocks"], list)  # as of a moves file: nodes get it as a parameter


def test_modes_that_leave_the_tip_alone_and_arms_without_any_keep_the_defaults(tmp_path: Path) -> None:
    model = the_strip()
    out = model.outputs
    C_pos = out.C_pos.copy()
    C_pos[out.rows("tip"), model.n_theta :] = 0.0
    assert "modal_energy" not in weights_for(replace(model, outputs=replace(out, C_pos=C_pos)), DT)
    stiff = small_arm(tmp_path, served__modes=0)
    assert task_for(str(stiff)).settings["mpc"] == {"arm_torque": True}


def test_the_mode_costs_as_much_as_the_axis_at_the_share_told() -> None:
    model, chosen = the_strip(), MpcConfig()
    rows = [i for i in model.outputs.rows("tip") if model.outputs.units[i] == "m"]
    axis, mode = (np.linalg.norm(model.outputs.C_pos[rows, k]) for k in range(2))
    swing = TIP_SHARE * axis * chosen.position_error / mode  # of the mode [m kg^0.5]
    energy = weights_for(model, DT)["modal_energy"]
    assert (model.omega[0] * swing) ** 2 / 2 == pytest.approx(energy, rel=ROUNDED)


@pytest.mark.slow
def test_a_stiff_arm_rests_closer_and_shakes_less_than_with_the_defaults_of_another(tmp_path: Path) -> None:
    task = task_for(str(small_arm(tmp_path, **STIFF)))
    (job,) = sim_jobs(task, [""], [NOMINAL])
    pd, by_arm = run_sim_job(job)
    others = {**task.settings, "mpc": {"stiffness_step": 0.1}}
    (defaults,) = run_sim_job(replace(job, task=replace(task, settings=others), laws=("mpc",)))
    assert by_arm.refusals == ()
    assert gain_db({"pd": pd, "mpc": by_arm}) > 18.0  # dB; 24.9, with the defaults 12.7
    assert by_arm.acceleration < 0.5 * defaults.acceleration
    assert farthest(by_arm) < 0.5 * farthest(defaults)


def farthest(result: SimResult) -> float:
    return max(leg.residual.distance for leg in result.legs)


LEGS = Path(__file__).parent / "arms/slides_and_legs.yaml"


def test_modes_that_a_tip_hardly_feels_cost_what_the_defaults_say() -> None:
    """By the tip's share 15 kJ of a leg of 59 g cost as much as axes off by 9 mrad: modes were free."""
    model = linearize(ReducedTree(load_config(LEGS), use_compiler=False))
    assert "modal_energy" not in weights_for(model, DT)
    assert task_for(str(LEGS)).under("").make("mpc", MpcConfig).modal_energy == MpcConfig().modal_energy


@pytest.mark.slow
def test_an_arm_whose_tip_hardly_feels_its_modes_stays_where_it_is_held() -> None:
    """Sags of metres were expected of its legs: sound sensors were refused at rest, the guard stopped it."""
    (job,) = sim_jobs(task_for(str(LEGS)), [""], [NOMINAL])
    for result in run_sim_job(job):
        assert result.failure == ""
        assert farthest(result) < 1e-3  # m, of the tip after a move
