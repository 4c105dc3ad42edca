"""The simulated arm without damping keeps its energy, stiff or looped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.sim.explicit_steps import ExplicitSteps
from flexarm_bringup.sim.implicit_steps import ImplicitSteps
from flexarm_bringup.sim.perturb import PlantSettings
from flexarm_bringup.sim.plant import Plant
from flexarm_model.manipulator.description import Joint, ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.closure_error import ClosureError

SECONDS = 10.0
TWO_LINK = Path(__file__).resolve().parents[3] / "docs" / "two_link.yaml"
RIGID_LOOP = Path(__file__).parent / "arms" / "rigid_four_bar.yaml"
STEPS = {
    "single_link": ExplicitSteps,
    "planar_3rrr": ImplicitSteps,
    "spatial_3tpt": ImplicitSteps,
    "serial_6r": ImplicitSteps,
    "variable_stiffness": ExplicitSteps,
}


def without_losses(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return the arm without damping and gravity."""

    def quiet(joint: Joint) -> Joint:
        return replace(
            joint, axes=tuple(replace(axis, damping=0.0, damping_ratio=0.0) for axis in joint.axes)
        )

    bodies: dict[str, Any] = {
        name: replace(body, damping_ratio=0.0, damping_time=0.0) if hasattr(body, "damping_time") else body
        for name, body in config.bodies.items()
    }
    joints, closures = (tuple(map(quiet, group)) for group in (config.joints, config.closures))
    return replace(config, bodies=bodies, joints=joints, closures=closures, gravity=np.zeros(3))


def energy(plant: Plant) -> float:
    """Return the kinetic and elastic energy [J]."""
    M = plant.tree.functions["mass_matrix"](plant.q)
    return float(plant.v @ M @ plant.v + plant.q @ plant.tree.K @ plant.q) / 2


@pytest.mark.slow
@pytest.mark.parametrize("name", STEPS)
def test_energy_drifts_by_less_than_1e_4_in_ten_seconds(name: str) -> None:
    config = without_losses(load_config(find_manipulator(name)))
    plant = Plant(config, 1.0 / config.rate_hz, PlantSettings(extra_modes=1))
    assert isinstance(plant._steps, STEPS[name])
    push = 1e-3 * np.array([axis.effort for axis in config.actuated.values()])
    for _ in range(round(0.1 * config.rate_hz)):
        plant.drive(push)
    records = []
    for _ in range(round(SECONDS * config.rate_hz)):
        plant.drive(0 * push)
        records.append(energy(plant))
    start, end = np.mean(records[: len(records) // 50]), np.mean(records[-len(records) // 50 :])
    assert start > 0
    assert abs(end - start) < 1e-4 * start
    assert abs(plant.tree.constraints(plant.q)[0]).max(initial=0.0) < 1e-9


@pytest.mark.parametrize(
    ("name", "preset", "share", "lost"),
    [("planar_3rrr", "geared", 0.03, 2e-5), pytest.param("serial_6r", "", 0.1, 1e-5, marks=pytest.mark.slow)],
)
def test_an_arm_that_swings_by_some_degrees_keeps_its_energy_too(
    name: str, preset: str, share: float, lost: float
) -> None:
    """With loops it lost 1.7e-4 of it: terms of velocity were of first order."""
    config = without_losses(load_config(find_manipulator(name), preset))
    plant = Plant(config, 1.0 / config.rate_hz, PlantSettings(extra_modes=1))
    push = share * np.array([axis.effort for axis in config.actuated.values()])
    for sign in (1.0, -1.0):
        for _ in range(round(0.05 * config.rate_hz)):
            plant.drive(sign * push)
    records = []
    for _ in range(round(SECONDS * config.rate_hz)):
        plant.drive(0 * push)
        records.append(energy(plant))
    start, end = np.mean(records[: len(records) // 50]), np.mean(records[-len(records) // 50 :])
    assert abs(end - start) < lost * start


@pytest.mark.parametrize(("share", "turns"), [(0.1, 3.0), (0.3, 8.0)])
def test_an_open_arm_that_turns_fast_keeps_its_energy_to_second_order(share: float, turns: float) -> None:
    """With terms of velocity of first order it was 8e-5 and 2.3e-4 off in this second, 1e-3 after ten."""
    config = without_losses(load_config(TWO_LINK))
    plant = Plant(config, 1.0 / config.rate_hz)
    efforts = np.array([axis.effort for axis in config.actuated.values()])
    drifts = []
    for substeps in (plant.substeps, 2 * plant.substeps):
        plant.reset()
        plant._steps = ImplicitSteps(plant.tree, plant.dt, substeps, 0.0)
        for k in range(50):
            plant.drive((share if k < 30 else -0.7 * share) * efforts * [1.0, -0.5])
        levels, fastest = [energy(plant)], 0.0
        for _ in range(200):
            plant.drive(0 * efforts)
            levels.append(energy(plant))
            fastest = max(fastest, float(abs(plant.theta_dot).max()))
        drifts.append(float(np.abs(np.array(levels) / levels[0] - 1.0).max()))
    print(f"\n{fastest:.1f} rad/s: energy off by {drifts[0]:.1e} at most, {drifts[1]:.1e} with half the step")
    assert fastest > turns
    assert drifts[0] < 1e-5
    assert 3.0 < drifts[0] / drifts[1] < 5.5  # four


def test_a_loop_of_rigid_bodies_is_refused_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", str(RIGID_LOOP), "--nominal"]) == 2
    assert "'rigid_four_bar': a loop without any elastic mode" in capsys.readouterr().err


def test_an_arm_that_is_driven_apart_says_that_it_was_driven_there() -> None:
    """A run that was unstable ended with "out of reach: try one nearer to home", as if of a goal."""
    config = load_config(find_manipulator("planar_3rrr"))
    plant = Plant(config, 1.0 / config.rate_hz)
    with pytest.raises(ClosureError, match="was driven there.*'flexarm margins'"):
        for _ in range(200):
            plant.drive(1e5 * np.array([1.0, -1.0, 1.0]))


@pytest.mark.parametrize("served", [0, 1, 9])
def test_a_mode_of_the_rig_rings_alike_whatever_is_served(served: int) -> None:
    """With one mode of 1.6 Hz served, the rig made one step of a period: 55 Hz were 44 Hz."""
    config = replace(without_losses(load_config(find_manipulator("planar_3rrr"))), modes=served)
    plant = Plant(config, 1.0 / config.rate_hz)
    model = linearize(plant.tree, modes=12)
    n = plant.theta.size
    for k in (8, 11):
        shape = model.Phi[:, n + k]
        plant.reset()
        plant.v = 1e-3 * shape
        seen = []
        for _ in range(400):
            plant.servo(np.zeros(n))
            seen.append(shape @ plant.tree.mass_matrix(plant.q) @ plant.v)
        power = abs(np.fft.rfft(np.array(seen) * np.hanning(400), 1 << 15))
        found = 2.0 * np.pi * power.argmax() / (1 << 15) * config.rate_hz
        assert found == pytest.approx(model.omega[k], rel=0.1)


def test_both_integrators_move_an_arm_alike() -> None:
    config = load_config(find_manipulator("single_link"))
    plant = Plant(config, 1.0 / config.rate_hz)
    explicit = plant._steps
    implicit = ImplicitSteps(plant.tree, plant.dt, 400, 0.0)
    q, v = plant.q, plant.v
    q_e, v_e = q.copy(), v.copy()
    for _ in range(20):
        q, v, _ = implicit.drive(q, v, np.array([5.0]))
        q_e, v_e, _ = explicit.drive(q_e, v_e, np.array([5.0]))
    assert q[0] == pytest.approx(q_e[0], rel=1e-4)
    assert v[0] == pytest.approx(v_e[0], rel=1e-3)


def test_an_implicit_servo_moves_its_axes_as_told() -> None:
    config = load_config(find_manipulator("single_link"))
    plant = Plant(config, 1.0 / config.rate_hz)
    implicit = ImplicitSteps(plant.tree, plant.dt, 20, 0.0)
    q, v, a = implicit.servo(plant.q, plant.v, np.array([2.0]))
    assert a[plant.tree.actuated] == pytest.approx([2.0])
    assert v[plant.tree.actuated] == pytest.approx([2.0 * plant.dt])
    assert q[plant.tree.actuated] == pytest.approx([plant.dt**2])
