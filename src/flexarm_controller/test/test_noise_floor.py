"""The floor that noise sets, against a scalar closed form and against the loop run with noise."""

from types import SimpleNamespace

import numpy as np
import pytest
from kalman_loop import DT, SIGMA
from scipy.signal import butter, sosfilt, zpk2ss
from served_arms import limits_of_hub, single_link
from test_margins import law_of, settle

from flexarm_controller.margins.full_plant import build_plant
from flexarm_controller.margins.loop import close_loop
from flexarm_controller.margins.noise_floor import Look, noise_floor

PLAIN = Look(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1)))


@pytest.fixture(scope="module")
def arm():
    model = single_link()
    settled = settle(model)
    loop = close_loop(
        build_plant(model, settled.rows, DT, 0.05), settled, law_of(model, limits_of_hub(), 1), 1
    )
    return loop, settled, build_plant(model, ("tip_accelerometer.y",), DT, 0.05)


def test_leaky_integrator_has_the_variance_of_the_textbook():
    a, gain, sigma = 0.9, 0.3, 2.0  # filter state x+ = a x + gain n drives the plant state p+ = x
    A = np.array([[0.0, 1.0], [0.0, a]])
    loop = SimpleNamespace(A=A, torque=np.zeros((1, 2)))
    filter_ = SimpleNamespace(F=np.array([[a]]), L=np.array([[gain]]))
    seen = SimpleNamespace(A=np.zeros((1, 1)), C=np.ones((1, 1)), E=np.zeros((1, 1)), b=np.zeros((1, 1)))
    found = noise_floor(loop, filter_, np.array([sigma]), seen, PLAIN)
    assert found == pytest.approx([gain * sigma / np.sqrt(1.0 - a**2)], rel=1e-12)


@pytest.mark.parametrize("is_filtered", [False, True])
def test_floor_is_what_a_run_with_noise_shows(arm, is_filtered):
    loop, settled, seen = arm
    design = {"N": 4, "Wn": 20.0, "fs": 1 / DT}
    look = Look(*zpk2ss(*butter(**design, output="zpk"))) if is_filtered else PLAIN
    noise = np.random.default_rng(0).standard_normal((40_000, 3)) * SIGMA
    n_p, n_f = len(loop.plant.A), len(settled.F)
    z, rows = np.zeros(len(loop.A)), np.zeros((len(noise), len(loop.A)))
    for k, sample in enumerate(noise):
        rows[k] = z
        z = loop.A @ z
        z[n_p : n_p + n_f] += settled.L @ sample
    signal = rows[:, :n_p] @ seen.C[0] + rows @ loop.torque.T @ seen.b.T @ seen.E[0]
    shown = sosfilt(butter(**design, output="sos"), signal) if is_filtered else signal
    found = noise_floor(loop, settled, SIGMA, seen, look)
    assert found[0] == pytest.approx(np.sqrt(np.mean(shown[1000:] ** 2)), rel=0.04)  # some 1000 swings


def test_floor_is_proportional_to_the_noise(arm):
    loop, settled, seen = arm
    assert noise_floor(loop, settled, 3 * SIGMA, seen, PLAIN) == pytest.approx(
        3 * noise_floor(loop, settled, SIGMA, seen, PLAIN)
    )


def test_loop_that_grows_has_no_floor(arm):
    loop, settled, seen = arm
    with pytest.raises(ValueError, match="not stable"):
        noise_floor(SimpleNamespace(A=1.1 * np.eye(3)), settled, SIGMA, seen, PLAIN)
