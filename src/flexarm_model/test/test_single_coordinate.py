"""An arm with one coordinate is an arm: a rigid pendulum on one motor, against its closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

MASS, CENTRE, LENGTH, ABOUT_CENTRE, ROTOR, GRAVITY = 1.0, 0.2, 0.4, 0.01, 0.1, 9.81
TEXT = f"""\
format: flexarm/1
name: pendulum
source: test
gravity: [0 m/s^2, -{GRAVITY} m/s^2, 0 m/s^2]
bodies:
  rod:
    type: rigid
    mass: {MASS} kg
    com: [{CENTRE} m, 0 m, 0 m]
    inertia: [0.001 kg m^2, {ABOUT_CENTRE} kg m^2, {ABOUT_CENTRE} kg m^2, 0 kg m^2, 0 kg m^2, 0 kg m^2]
    nodes: {{end: [{LENGTH} m, 0 m, 0 m]}}
joints:
  motor: {{parent: world, child: rod.root, axes: {{rz: {{actuated: true, rotor_inertia: {ROTOR} kg m^2}}}}}}
sensors: {{encoder: {{kind: encoder, axis: motor.rz, sigma: 20 urad}}}}
tip: rod.end
served: {{modes: 0, home: [0 deg], rate: 200 Hz}}
"""


@pytest.fixture
def pendulum(tmp_path: Path) -> ReducedTree:
    path = tmp_path / "pendulum.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return ReducedTree(load_config(path), use_compiler=False)


def test_a_pendulum_has_the_mass_and_the_weight_of_the_closed_form(pendulum: ReducedTree) -> None:
    angle = 0.5
    model = linearize(pendulum, np.array([angle]))
    weight = MASS * GRAVITY * CENTRE
    assert model.M[0, 0] == pytest.approx(ABOUT_CENTRE + MASS * CENTRE**2 + ROTOR, rel=1e-12)
    assert model.f0 == pytest.approx([weight * np.cos(angle)], rel=1e-12)
    assert model.omega.size == 0 and model.Phi.shape == (1, 1)


def test_its_matrices_are_matrices(pendulum: ReducedTree) -> None:
    q = np.array([0.5])
    M, D, K, f = pendulum.linearisation(q)
    assert M.shape == D.shape == K.shape == (1, 1) and f.shape == (1,)
    assert K[0, 0] == pytest.approx(-MASS * GRAVITY * CENTRE * np.sin(0.5), rel=1e-12)
    moving, bias = pendulum.functions["motion"](q, np.zeros(1))
    assert moving.shape == (1, 1) and bias.shape == (1,)


def test_its_tip_and_its_outputs_move_as_the_rod_turns(pendulum: ReducedTree) -> None:
    angle = 0.5
    J = pendulum.tip_jacobian(np.array([angle]))
    expected = [-LENGTH * np.sin(angle), LENGTH * np.cos(angle), 0, 0, 0, 1]
    assert J.shape == (6, 1) and J[:, 0] == pytest.approx(expected, abs=1e-12)
    outputs = linearize(pendulum, np.array([angle])).outputs
    assert outputs.C_pos.shape == outputs.C_vel.shape == outputs.C_acc.shape == (7, 1)
    assert outputs.C_pos[:, 0] == pytest.approx([1, 0, LENGTH, 0, 0, 0, 1], abs=1e-12)  # in the tip's axes
