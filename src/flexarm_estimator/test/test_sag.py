"""Static deflections as states: what they do in closed form, and what they are good for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from planar_strip import (
    LENGTH,
    PHI,
    SENSORS,
    STRAIN,
    StripKinematics,
    arriving,
    camera_sample,
    run,
    simulate,
    strip_model,
)
from scipy.linalg import solve_continuous_lyapunov

from flexarm_estimator.adoption import map_parts
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled import settled_filter
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sag import sag_sigma, sag_states
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
MACHINES = Path(__file__).parents[2] / "flexarm_bringup/config/manipulators"
SAGGING = EstimatorConfig(sag_modes=3, sag_error=2e-3, sag_time=4.0)


def test_without_sag_modes_the_state_is_as_long_as_ever() -> None:
    plain = ProcessModel(strip_model(), EstimatorConfig())
    assert plain.layout.n_x == plain.system.n_x == 9
    assert plain.layout.n_s == 0


def test_only_the_slowest_modes_sag_where_so_wanted() -> None:
    process = ProcessModel(strip_model(), replace(SAGGING, sag_modes=1))
    assert process.layout.n_s == 1
    assert sag_sigma(strip_model(), replace(SAGGING, sag_modes=1)) * PHI[0] == pytest.approx(2e-3)
    assert (
        ProcessModel(strip_model(), replace(SAGGING, sag_modes=9)).layout.n_s == 3
    )  # no more than there are


def test_a_tip_that_hardly_feels_modes_says_nothing_of_how_they_rest() -> None:
    """A millimetre at such a tip was metres in a leg: 33,000 ustrain were expected of gauges at rest."""
    model = strip_model()
    C_pos = model.outputs.C_pos.copy()
    C_pos[model.outputs.rows("tip")[:3], model.n_theta :] *= 0.01
    legs = replace(model, outputs=replace(model.outputs, C_pos=C_pos))
    assert sag_sigma(model, SAGGING).all() and not sag_sigma(legs, SAGGING).any()
    assert ProcessModel(legs, SAGGING).layout.n_s == 3  # they are there at poses where the tip tells


def test_arm_rests_at_the_static_deflection() -> None:
    process = ProcessModel(strip_model(), SAGGING)
    layout, system = process.layout, process.system
    x = np.zeros(layout.n_x)
    x[layout.s] = x[layout.eta] = [0.01, -0.002, 0.001]
    rate = system.A @ x
    assert abs(rate[: layout.s.start]).max() < 1e-9  # of accelerations of 10; at rest for as long as s stays
    np.testing.assert_allclose(rate[layout.s], -x[layout.s] / 4.0)
    x[layout.s] = 0.0
    assert abs(system.A @ x)[layout.eta_dot].max() > 1.0


def test_gauges_and_accelerometers_feel_what_the_deflection_does_to_the_arm() -> None:
    """At rest an accelerometer is silent and a gauge says the strain of eta, with or without s."""
    process = ProcessModel(strip_model(), SAGGING)
    layout, C = process.layout, process.system.C
    x = np.zeros(layout.n_x)
    x[layout.s] = x[layout.eta] = [0.01, -0.002, 0.001]
    assert C[1] @ x == pytest.approx(STRAIN @ x[layout.eta])
    assert C[2] @ x == pytest.approx(0.0, abs=1e-9)


def test_deflections_are_as_large_at_the_tip_as_the_setting_says() -> None:
    process = ProcessModel(strip_model(), SAGGING)
    s = process.layout.s
    spread = solve_continuous_lyapunov(process.system.A[s, s], -process.system.Q[s, s])
    assert np.sqrt(PHI @ spread @ PHI) == pytest.approx(SAGGING.sag_error)
    np.testing.assert_allclose(process.P0[s, s], spread, atol=1e-20)


def test_forces_of_all_modes_are_equally_uncertain() -> None:
    model = strip_model()
    force = sag_sigma(model, SAGGING) * model.omega**2
    np.testing.assert_allclose(force, force[0])


def hub_model(rounding: float) -> ReducedModel:
    """Return the strip with its tip on the hub: no mode moves it, but for rounding."""
    model = strip_model()
    C_pos, tip = model.outputs.C_pos.copy(), model.outputs.rows("tip")
    C_pos[tip, 1:] = rounding * C_pos[tip, 1:]
    return replace(model, outputs=replace(model.outputs, C_pos=C_pos))


@pytest.mark.parametrize("rounding", [0.0, 1e-13])
def test_modes_that_do_not_move_the_tip_have_no_error_there_and_stay_where_they_are(rounding: float) -> None:
    process = ProcessModel(hub_model(rounding), SAGGING)
    s = process.layout.s
    assert process.layout.n_s == 3  # as many as at a pose where they move it
    assert not process.P0[s, s].any() and not process.system.Q[s, s].any()
    plain, told = (
        settled_filter(Estimator(hub_model(rounding), StripKinematics(), SENSORS, config), 0.005)
        for config in (EstimatorConfig(), SAGGING)
    )
    rows = len(plain.L)
    np.testing.assert_allclose(told.L[:rows], plain.L, rtol=1e-6, atol=1e-9 * abs(plain.L).max())


def test_filter_finds_where_a_loaded_arm_rests() -> None:
    """A force on the first mode that no model has: 3 mm at the tip, which only the camera sees."""
    model = strip_model()
    force = 3e-3 / PHI[0] * model.omega[0] ** 2
    loaded = replace(model, f0=np.array([0.0, -force, 0.0, 0.0]))
    x0 = np.zeros(9)
    x0[1] = 3e-3 / PHI[0]
    record = simulate(400, np.random.default_rng(1), x0, loaded, camera_every=7)
    true_tip = [StripKinematics().tip_pose(x[:4])[:2, 3] for x in record.x[300:]]
    sensors, errors = [spec for spec in SENSORS if spec.kind != "strain_gauge"], []
    for config in (EstimatorConfig(), SAGGING):
        told = [estimate.T_world_tip[:2, 3] for estimate in run(record, sensors=sensors, config=config)[300:]]
        errors.append(np.sqrt(np.mean(np.square(np.subtract(told, true_tip)))))
    assert errors[1] < errors[0] / 3
    assert errors[1] < 1e-3 * LENGTH


def test_an_arm_that_starts_anew_where_it_is_hangs_as_it_was_learned() -> None:
    parts = Estimator(strip_model(), StripKinematics(), SENSORS, SAGGING).prepare(strip_model())
    x = 1e-4 * np.random.default_rng(3).normal(size=parts.layout.n_x)
    rest = parts.stopped(x).x
    np.testing.assert_array_equal(rest[parts.layout.s], x[parts.layout.s])
    np.testing.assert_array_equal(rest[parts.layout.eta], x[parts.layout.s])
    assert abs(parts.process.system.A @ rest)[parts.layout.eta_dot].max() < 1e-9


def test_deflections_follow_the_modes_of_another_model() -> None:
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, SAGGING)
    old = estimator.prepare(strip_model())
    turned = replace(strip_model(), Phi=strip_model().Phi @ np.diag([1.0, 1.0, -1.0, 1.0]))
    new = estimator.prepare(turned)
    T = map_parts(old, new).T
    np.testing.assert_allclose(T[new.layout.s, old.layout.s], np.diag([1.0, -1.0, 1.0]))
    assert T.shape == (12, 12)


SHARED = replace(SAGGING, sag_share=0.5, sag_error=1e-4)
HEAVY = 0.4  # share by which the real arm is heavier


def hanging(sag: float) -> ReducedModel:
    """Return the strip at a pose where its weight bends it, its tip by about ``sag`` [m]."""
    force = sag / PHI[0] * strip_model().omega[0] ** 2
    return replace(strip_model(), q0=np.array([0.0, *(force / strip_model().omega ** 2)]))


def test_own_sag_is_what_a_little_more_weight_adds() -> None:
    """Against the equilibrium of an arm of springs that is found anew with more gravity."""
    rest = []
    for more in (1.0, 1.001):
        path, changes = MACHINES / "variable_stiffness.yaml", {"gravity.2": f"{-9.81 * more} m/s^2"}
        tree = ReducedTree(load_config(path, changes=changes), use_compiler=False)
        model = linearize(tree, np.array([0.3, 0.5, -0.9]))
        rest.append((model, sag_states(model, SAGGING, tree.borne(model.q0)).own))
    (model, own), (heavier, _) = rest
    added = np.linalg.lstsq(model.Phi[:, 3:], heavier.q0 - model.q0, rcond=None)[0]
    assert abs(model.Phi[:, 3:] @ own).max() > 5e-3  # rad
    np.testing.assert_allclose(own, added / 1e-3, rtol=2e-3, atol=1e-2 * abs(own).max())


def test_gauges_say_all_of_a_share_also_what_no_served_mode_shows() -> None:
    """Against the gauges of an arm of springs and beams that hangs under a little more gravity."""
    said, pose = [], np.array([0.0, 0.578, -0.136, 0.0, 1.127, 0.0])
    for more in (1.0, 1.001):
        changes = {"gravity.2": f"{-9.81 * more} m/s^2"}
        tree = ReducedTree(load_config(MACHINES / "serial_6r.yaml", changes=changes), use_compiler=False)
        model = linearize(tree, pose)
        said.append(model.outputs.y0)
        if more == 1.0:
            process = ProcessModel(model, replace(SHARED, sag_modes=7), None, tree.borne(model.q0))
    gauges = [i for i, name in enumerate(model.outputs.names) if name.endswith(".strain")]
    added = (said[1] - said[0])[gauges] / 1e-3
    layout, own = process.layout, process.sag.own
    x = np.zeros(layout.n_x)
    x[layout.w], x[layout.s], x[layout.eta] = 1.0, own, own
    told = process.system.C[gauges] @ x
    assert abs(added).max() > 3e-5
    np.testing.assert_allclose(told, added, atol=2e-8)
    sigma = [spec.sigma[0] for spec in tree.config.sensors if spec.kind == "strain_gauge"]
    beyond = process.sag.beyond[gauges, 0]
    for i, found, part, noise in zip(gauges, added, beyond, sigma, strict=True):
        print(f"{model.outputs.names[i]}: {found:.3g} under its weight, {part:.2g} of it, "
              f"{abs(part) / noise:.1f} times the noise, by modes that are not served")  # fmt: skip
    assert max(abs(beyond) / sigma) > 5.0


def test_what_is_known_of_the_sag_at_the_start_is_known_as_long_as_nobody_looks() -> None:
    model = hanging(5e-3)
    states = sag_states(model, SHARED, StripKinematics().borne(model.q0))
    assert (states.n_w, states.n_s) == (1, 3)
    np.testing.assert_allclose(states.A @ states.P0 + states.P0 @ states.A.T, -states.Q, atol=1e-18)
    tip = np.array([0.0, *PHI])
    assert np.sqrt(tip @ states.P0 @ tip) == pytest.approx(np.hypot(SHARED.sag_error, 0.5 * PHI @ states.own))


def test_a_share_of_the_sag_that_was_learned_is_known_at_the_next_pose() -> None:
    """Heavier by 40 %: a camera tells it where the arm hangs by 5 mm, and nobody where it hangs by -8."""
    here, there = hanging(5e-3), hanging(-8e-3)
    own, next_own = (sag_states(at, SHARED, StripKinematics().borne(at.q0)).own for at in (here, there))
    loaded = replace(here, f0=np.array([0.0, *(-HEAVY * own * here.omega**2)]))
    x0 = np.zeros(9)
    x0[1:4] = HEAVY * own
    record = simulate(400, np.random.default_rng(1), x0, loaded)
    q = [here.q0 + x[:4] - here.xi0 for x in record.x]
    for k in range(0, 401, 7):
        record.samples[k].append(camera_sample(q[k], float(record.t[k])))
    found = {}
    for config in (SAGGING, SHARED):
        estimator = Estimator(here, StripKinematics(), SENSORS, config)
        for k, t in enumerate(record.t.tolist()):
            estimator.step(arriving(record, k), record.tau[k], t)
        estimator.adopt(there)
        estimate = estimator.step([], record.tau[-1], float(record.t[-1]) + 0.005)
        found[config] = PHI @ (estimate.x[estimate.layout.s] - HEAVY * next_own)
    more = abs(HEAVY * PHI @ next_own)  # 3.2 mm; without a share the sag of here is taken along
    assert abs(found[SHARED]) < 0.1 * more < more < abs(found[SAGGING])


def test_a_share_stays_as_the_pose_changes_and_the_rest_follows_the_modes() -> None:
    estimator = Estimator(hanging(5e-3), StripKinematics(), SENSORS, SHARED)
    old, new = (estimator.prepare(hanging(sag)) for sag in (5e-3, -8e-3))
    x, more = np.zeros(old.layout.n_x), np.array([0.01, -0.02, 0.03])
    x[old.layout.w], x[old.layout.s] = HEAVY, HEAVY * old.process.sag.own + more
    found = map_parts(old, new).T @ x
    assert found[new.layout.w] == pytest.approx([HEAVY])
    np.testing.assert_allclose(found[new.layout.s], HEAVY * new.process.sag.own + more)
    assert PHI @ new.process.sag.own == pytest.approx(-8e-3, rel=0.2)
