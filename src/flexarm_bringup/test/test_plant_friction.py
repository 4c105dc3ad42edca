"""Friction of the simulated arm: it takes energy and gives none, and an arm that nothing drives stands."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.sim.explicit_steps import ExplicitSteps
from flexarm_bringup.sim.implicit_period import MachinePeriod, PlainPeriod, Stepping, make_period
from flexarm_bringup.sim.implicit_steps import ImplicitSteps
from flexarm_bringup.sim.perturb import PlantSettings
from flexarm_bringup.sim.plant import Plant
from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

TWO_LINK = str(Path(__file__).resolve().parents[3] / "docs" / "two_link.yaml")
ARMS = (
    ("single_link", "light_hub"),
    ("variable_stiffness", ""),
    (TWO_LINK, ""),
    pytest.param("serial_6r", "guyan", marks=pytest.mark.slow),
    ("planar_3rrr", ""),
    ("spatial_3tpt", "exp"),
)
PUSHED, WATCHED = 0.05, 0.3  # s


def plant_of(name: str, preset: str, friction: float) -> Plant:
    """Return an arm without weight."""
    config = replace(load_config(find_manipulator(name), preset), gravity=np.zeros(3))
    return Plant(config, 1.0 / config.rate_hz, PlantSettings(friction=friction))


def push(plant: Plant, friction: float) -> None:
    """Let the first motor push for a moment with more than its friction."""
    efforts = np.array([axis.effort for axis in plant.tree.config.actuated.values()])
    tau = np.zeros(efforts.size)
    tau[0] = friction + 0.3 * efforts[0]
    for _ in range(round(PUSHED / plant.dt)):
        plant.drive(tau)


def energy(plant: Plant) -> float:
    """Return the kinetic and elastic energy [J]."""
    return float(plant.v @ plant.tree.mass_matrix(plant.q) @ plant.v + plant.q @ plant.tree.K @ plant.q) / 2


@pytest.mark.parametrize("friction", [1.0, 100.0])
@pytest.mark.parametrize(("name", "preset"), ARMS)
def test_an_arm_that_nothing_drives_only_loses_energy_and_stands(
    name: str, preset: str, friction: float
) -> None:
    """Axes chattered for ever: of the 3RRR at 1 N m, whose loops tore, and of every arm that was explicit."""
    plant = plant_of(name, preset, friction)
    push(plant, friction)
    still, levels = np.zeros(plant.theta.size), [energy(plant)]
    for _ in range(round(WATCHED / plant.dt)):
        plant.drive(still)
        levels.append(energy(plant))
    grown = np.diff(levels).max() / levels[0]
    print(f"\n{name} {preset}, {friction:g} N m: {type(plant._steps).__name__}, {plant.substeps} steps; ")
    print(f"energy grows by {grown:.1e} at most; {abs(plant.theta_dot).max():.1e} rad/s are left")
    assert grown < 0.0
    if friction == 100.0:
        assert abs(plant.theta_dot).max() < 0.01


def test_friction_that_explicit_steps_would_need_too_many_for_is_stepped_implicitly() -> None:
    few, more, many = (plant_of("variable_stiffness", "", friction) for friction in (0.0, 2.0, 20.0))
    assert isinstance(few._steps, ExplicitSteps) and isinstance(more._steps, ExplicitSteps)
    assert few.substeps < more.substeps
    assert isinstance(many._steps, ImplicitSteps)


def test_both_integrators_move_an_arm_with_friction_alike() -> None:
    """Pushed to and fro, it sticks, slides and turns round."""
    plant = plant_of("variable_stiffness", "", 2.0)
    implicit = ImplicitSteps(plant.tree, plant.dt, 7, 2.0)
    q, v = plant.q, plant.v
    most = 2.0 + 0.3 * next(iter(plant.tree.config.actuated.values())).effort
    for k in range(120):
        tau = np.array([most * np.sin(2 * np.pi * k * plant.dt / 0.4), 0.0, 0.0])
        plant.drive(tau)
        q, v, _ = implicit.drive(q, v, tau)
        assert q[plant.tree.actuated] == pytest.approx(plant.theta, abs=2e-4)  # of 0.4 rad


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize(("name", "passes"), [("variable_stiffness", 1), ("planar_3rrr", 2)])
def test_machine_code_and_numpy_take_large_friction_alike(name: str, passes: int) -> None:
    tree = plant_of(name, "", 5.0).tree
    stepping = Stepping(1e-3, 5, 5.0, True, passes)
    fast, plain = make_period(tree, stepping), PlainPeriod(tree, stepping)
    assert isinstance(fast, MachinePeriod)
    a = b = (tree.loops.home.copy(), np.zeros(tree.n_q), np.zeros(tree.n_q))
    grips = set()
    for k in range(40):
        u = np.array([6.0 * np.sin(0.5 * k), 0.0, 0.0])
        a, b = fast.advance(*a[:2], u), plain.advance(*b[:2], u)
        grips |= set(plain._grip.tolist())
        np.testing.assert_allclose(a[1], b[1], rtol=0, atol=1e-8 * abs(b[1]).max())
    assert len(grips) > 1
