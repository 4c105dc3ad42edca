"""Who sees and who drives a mode: closed forms, symmetry, and energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm, tree
from scipy.linalg import eigh

from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.modal.candidates import candidate_config, noise, sample_rates
from flexarm_model.modal.observability import ENERGY, Swing, mode_reach, tip_energy
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.served.tip_moves import are_felt, tip_moves, tip_turns
from flexarm_model.tree.reduced_tree import ReducedTree

OMEGA = np.array([30.0, 30.0, 200.0])
EFFORT = np.array([2.0, 4.0])


def outputs(names: list[str], C_pos: np.ndarray, C_acc: np.ndarray) -> Outputs:
    m = len(names)
    return Outputs(tuple(names), ("1",) * m, np.zeros(m), C_pos, np.zeros_like(C_pos), C_acc)


def symmetric() -> ReducedModel:
    """Return two axes, a doublet that they drive one way each, and a mode that nobody drives or sees.

    Coordinates are [theta_1, theta_2, left-right, up-down, twist]; one gauge and one accelerometer look
    left-right, a second gauge up-down.
    """
    M = np.eye(5) * [2.0, 2.0, 1.0, 1.0, 1.0]
    M[0, 2] = M[2, 0] = 0.5
    M[1, 3] = M[3, 1] = 0.25
    C_pos, C_acc = np.zeros((4, 5)), np.zeros((4, 5))
    C_pos[0, 2], C_pos[1, 3], C_acc[2, 2], C_pos[3, 0] = 0.1, 0.1, 2.0, 1.0
    return ReducedModel(
        "symmetric", "", ("a.rz", "b.rz"), np.zeros(2), M, np.diag([0.0, 0.0, *(0.02 * OMEGA)]),
        np.diag([0.0, 0.0, *OMEGA**2]), np.eye(5)[:, :2].copy(), np.zeros(5), OMEGA, np.full(3, 0.01),
        outputs(["gauge.left", "gauge.up", "imu.y", "encoder.a"], C_pos, C_acc), np.zeros(5), np.eye(5),
    )  # fmt: skip


SIGMA = {"gauge.left": 1e-6, "gauge.up": 1e-6, "imu.y": 0.1, "encoder.a": 1e-5}


def test_signals_are_amplitudes_of_the_stated_energy_over_the_noise() -> None:
    found = mode_reach(symmetric(), SIGMA, EFFORT, swing=Swing(energy=2e-6)).sensors
    a = 2e-3 / 30.0  # 0.5 (omega a)^2 = 2 uJ
    assert found.share[0] == pytest.approx([0.1 * a / 1e-6, 0.0, 2.0 * 30.0**2 * a / 0.1, 0.0])
    assert found.by(0) == ("gauge.left", "imu.y") and found.by(1) == ("gauge.up",)
    assert found.reached.tolist() == [True, True, False]


def test_a_period_shows_what_least_squares_find_in_its_samples() -> None:
    """A camera that a slow mode moves by 0.2 of its noise was said not to see it."""
    sigma, n = {**SIGMA, "gauge.left": 1e-3, "imu.y": 1e6}, 60
    energy = 0.5 * (30.0 * 2e-3) ** 2  # an amplitude of 2 mm, of which the gauge has a tenth
    swing = Swing(energy=energy, rates={"gauge.left": n * 30.0 / (2 * np.pi)})
    found = mode_reach(symmetric(), sigma, EFFORT, swing=swing)
    phase = 2 * np.pi * np.arange(n) / n
    phases = np.column_stack([np.cos(phase), np.sin(phase)])
    noise_of_either = np.sqrt(np.diag(np.linalg.inv(phases.T @ phases)))
    assert found.sensors.share[0, 0] == pytest.approx(0.2) and not found.sensors.reached[0]
    assert 0.2 / noise_of_either == pytest.approx(np.full(2, found.over_period.share[0, 0]), rel=1e-9)
    assert found.over_period.share[:, 1:] == pytest.approx(found.sensors.share[:, 1:])  # one sample there
    assert found.verdict(0).startswith("mode 1, 4.775 Hz: seen by gauge.left over a period; driven by ")


def test_sensors_without_a_rate_of_their_own_are_sampled_once_per_control_period() -> None:
    config = arm("single_link")
    rates = sample_rates(config)
    assert set(rates) == set(noise(config)) and min(rates.values()) > 0.0
    for sensor in config.sensors:
        expected = sensor.rate_hz if sensor.rate_hz else config.rate_hz
        assert {rates[f"{sensor.name}.{channel}"] for channel in sensor.channels} == {expected}


def test_drive_is_the_quasi_static_push_at_full_torque_with_free_axes() -> None:
    found = mode_reach(symmetric(), SIGMA, EFFORT).motors
    a = np.sqrt(2e-6) / 30.0
    acceleration = 0.5 / (2.0 * 1.0 - 0.5**2)  # of eta_1 per N m on axis a: 2 x 2 inverse by hand
    assert found.share[0] == pytest.approx([2.0 * acceleration / (30.0**2 * a), 0.0])
    assert found.reached.tolist() == [True, True, False]


def test_free_modes_are_driven_by_their_own_motion_of_the_axis() -> None:
    model = symmetric()
    values, vectors = eigh(model.K, model.M)
    omega, shapes = np.sqrt(values[2:]), vectors[:, 2:]
    found = mode_reach(model, SIGMA, EFFORT, swing=Swing(locked=False))
    assert found.modes.omega == pytest.approx(omega)
    expected = abs(shapes.T @ model.B) * EFFORT / (omega * np.sqrt(2e-6))[:, None]
    assert found.motors.share == pytest.approx(expected, abs=1e-9)


def test_an_accelerometer_that_gravity_turns_against_its_motion_reads_the_difference() -> None:
    model = symmetric()
    C_pos = model.outputs.C_pos.copy()
    C_pos[2, 2] = 500.0
    tilted = replace(model, outputs=replace(model.outputs, C_pos=C_pos))
    found = mode_reach(tilted, SIGMA, EFFORT).sensors
    assert found.share[0, 2] == pytest.approx((2.0 * 30.0**2 - 500.0) * np.sqrt(2e-6) / 30.0 / 0.1)


def test_one_direction_of_a_doublet_that_nobody_sees_makes_the_pair_unseen() -> None:
    """However the pair happens to be turned: each mode alone would pass for seen."""
    model = symmetric()
    turn = np.eye(5)
    turn[2:4, 2:4] = [[0.6, -0.8], [0.8, 0.6]]
    out = replace(model.outputs, C_pos=model.outputs.C_pos @ turn, C_acc=model.outputs.C_acc @ turn)
    turned = replace(model, M=turn.T @ model.M @ turn, outputs=out)
    one = {name: SIGMA[name] for name in ("gauge.left", "imu.y")}
    found = mode_reach(turned, one, EFFORT)
    assert (found.sensors.share[:2, 0] > 1.0).all()
    assert found.sensors.weakest[:2] == pytest.approx(0.0, abs=1e-9)
    assert not found.sensors.reached[:2].any()
    assert "only a part of a multiple mode" in found.verdict(0)
    both = mode_reach(turned, SIGMA, EFFORT)
    assert both.sensors.reached[:2].all()
    assert both.sensors.weakest == pytest.approx(mode_reach(model, SIGMA, EFFORT).sensors.weakest, abs=1e-9)


def test_an_unseen_mode_names_the_sensor_that_could_see_it() -> None:
    spare = outputs(["top.twist"], np.array([[0.0, 0.0, 0.0, 0.0, 5.0]]), np.zeros((1, 5)))
    found = mode_reach(symmetric(), SIGMA, EFFORT, (spare, {"top.twist": 1e-6}))
    assert found.verdict(2) == (
        "mode 3, 31.83 Hz: seen by nothing mounted alone; could be seen by top.twist; driven by no motor"
    )
    assert "seen by gauge.left" in found.verdict(0) and "could" not in found.verdict(0)
    assert "no sensor known here" in mode_reach(symmetric(), SIGMA, EFFORT).verdict(2)


def test_a_free_hub_lets_its_encoder_see_the_modes_and_a_held_one_does_not() -> None:
    config = arm("single_link", "light_hub")
    model = linearize(tree("single_link", "light_hub"))
    effort = np.array([axis.effort for axis in config.actuated.values()])
    held, free = (
        mode_reach(model, noise(config), effort, swing=Swing(locked=locked)) for locked in (True, False)
    )
    row = held.sensors.names.index("encoder.position")
    assert held.modes.f_hz == pytest.approx(model.omega / (2 * np.pi))
    assert held.sensors.share[:, row] == pytest.approx(0.0, abs=1e-12)
    assert free.sensors.share[0, row] > 1.0
    assert free.modes.f_hz[0] > 2.0 * held.modes.f_hz[0]  # the hub recoils
    assert held.sensors.reached.all() and held.motors.reached.all()


def test_without_its_sensors_an_arm_asks_for_one_of_them_back() -> None:
    config = arm("single_link", "geared")
    blind = replace(config, sensors=tuple(sensor for sensor in config.sensors if sensor.kind == "encoder"))
    imu = next(sensor for sensor in config.sensors if sensor.kind == "accelerometer")
    possible = candidate_config(blind, extra=[imu])
    nodes = ("hub_root", "strip_root", "strip_gauge", "strip_tip")
    assert {sensor.name for sensor in possible.sensors} == {imu.name} | {
        f"{imu.name}_at_{node}" for node in nodes
    }
    spare = linearize(ReducedTree(possible, use_compiler=False)).outputs
    model = linearize(ReducedTree(blind, use_compiler=False))
    found = mode_reach(model, noise(blind), np.array([28.0]), (spare, noise(possible)))
    assert not found.sensors.reached.any()
    for mode in range(3):
        assert found.possible.by(mode)[0] == f"{imu.name}_at_strip_tip.y"  # y is across the strip
        assert not any(name.endswith((".z", "_root.y")) for name in found.possible.by(mode))
        assert f"could be seen by {imu.name}_at_strip_tip.y" in found.verdict(mode)


def test_gauges_stay_on_their_own_body_and_get_no_channels_they_lack() -> None:
    found = candidate_config(arm("spatial")).sensors
    gauges = [sensor for sensor in found if sensor.kind == "strain_gauge"]
    assert {sensor.site for sensor in gauges} == {"fore.root", "fore.gauge", "fore.end"}
    assert {sensor.channels for sensor in gauges} == {("strain",)}
    assert {"upper.end", "fore.root"} < {sensor.site for sensor in found if sensor.kind == "accelerometer"}
    link = candidate_config(arm("single_link", "geared"))
    imu = next(sensor for sensor in link.sensors if sensor.name == "tip_accelerometer")
    assert imu.channels == ("x", "y", "z") and imu.sigma == pytest.approx(np.full(3, 0.03))


def test_encoders_are_tried_at_axes_of_their_dimension_that_have_none() -> None:
    rigid = arm("spatial_rigid")
    angle = SensorSpec("angle", "encoder", "base.rz", ("position",), np.array([1e-4]))
    found = candidate_config(replace(rigid, sensors=(*rigid.sensors, angle))).sensors
    encoders = {sensor.name: sensor.site for sensor in found if sensor.kind == "encoder"}
    sites = {"shoulder.ry", "wrist.rx", "wrist.rz"}
    assert encoders == {f"angle_at_{site.replace('.', '_')}": site for site in sites}
    strained = [sensor.site for sensor in found if sensor.kind == "strain_gauge"]
    assert not strained


def test_the_energy_of_a_swing_suits_the_machine() -> None:
    model = linearize(tree("single_link"))
    energy = tip_energy(model, 2e-4)
    moves = np.linalg.norm(model.outputs.C_pos[model.outputs.rows("tip")[:3]], axis=0)[1:]
    amplitude = np.sqrt(2 * energy) / model.omega
    assert (moves * amplitude).max() == pytest.approx(2e-4) and np.argmax(moves * amplitude) == 0
    still = replace(model, outputs=replace(model.outputs, C_pos=np.zeros_like(model.outputs.C_pos)))
    assert tip_energy(still) == ENERGY


def test_what_rounding_leaves_of_a_tip_that_no_mode_moves_is_no_movement() -> None:
    model = linearize(tree("single_link"))
    moves = tip_moves(model)
    rows = model.outputs.rows("tip")[:3]
    np.testing.assert_array_equal(moves, np.linalg.norm(model.outputs.C_pos[rows, model.n_theta :], axis=0))
    C_pos = model.outputs.C_pos.copy()
    C_pos[rows, model.n_theta :] *= 1e-12
    hub = replace(model, outputs=replace(model.outputs, C_pos=C_pos))
    assert not tip_moves(hub).any() and tip_energy(hub) == ENERGY
    C_pos = C_pos.copy()
    C_pos[rows, : model.n_theta] = 0.0  # a tip on the hub's axis: nothing at all moves it
    assert not tip_moves(replace(model, outputs=replace(model.outputs, C_pos=C_pos))).any()


def test_what_rounding_leaves_of_a_tip_that_nothing_turns_is_no_turn() -> None:
    """A slider on a rail: every coordinate turned it by 1e-12, so each was as large as the largest."""
    model = linearize(tree("single_link"))
    rows = model.outputs.rows("tip")[3:]
    turns = np.linalg.norm(model.outputs.C_pos[rows, model.n_theta :], axis=0)
    np.testing.assert_array_equal(tip_turns(model), turns)
    for scale, axis_turns in ((1e-12, True), (1e-12, False), (1e-4, False)):
        C_pos = model.outputs.C_pos.copy()
        C_pos[rows, model.n_theta :] *= scale
        C_pos[rows, : model.n_theta] *= axis_turns
        slider = replace(model, outputs=replace(model.outputs, C_pos=C_pos))
        assert tip_turns(slider) == pytest.approx(turns * (scale if scale > 1e-6 else 0.0), rel=1e-12)


def test_modes_that_a_tip_hardly_feels_do_not_swing_by_what_it_does() -> None:
    """Of legs between hinges the platform showed 1 % of their bending: every mode swung with 12 J."""
    model = linearize(tree("single_link"))
    C_pos = model.outputs.C_pos.copy()
    rows = model.outputs.rows("tip")[:3]
    for share, felt in ((0.2, True), (0.02, False)):
        C_pos[rows, model.n_theta :] = share * model.outputs.C_pos[rows, model.n_theta :]
        legs = replace(model, outputs=replace(model.outputs, C_pos=C_pos.copy()))
        assert tip_moves(legs).all() and are_felt(legs) is felt
        assert (tip_energy(legs) == ENERGY) is not felt
    assert are_felt(model, 1) and not are_felt(model, 0)


def test_tables_that_make_no_sense_are_refused() -> None:
    with pytest.raises(KeyError, match="no output row 'imu.q'; known: gauge.left"):
        mode_reach(symmetric(), {"imu.q": 1.0}, EFFORT)
    with pytest.raises(ValueError, match="noise must be positive"):
        mode_reach(symmetric(), {"imu.y": 0.0}, EFFORT)
    with pytest.raises(ValueError, match="need 2 positive efforts"):
        mode_reach(symmetric(), SIGMA, np.ones(3))
