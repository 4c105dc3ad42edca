"""What a law lets grow in a short time: closed forms, simulated kicks, and the words of the gate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from flexarm_controller.margins.full_plant import FullPlant
from flexarm_controller.margins.loop import ClosedLoop
from flexarm_controller.margins.short_law import ShortCase, examine_short
from flexarm_controller.margins.verdict import firm_shortfalls, firm_verdict
from flexarm_controller.settings import MarginConfig

DT, LASTS, HZ = 0.005, 0.6, 2 * np.pi
POSE = np.zeros(1)


def loop_of(omega: list[float], damping: np.ndarray, swap: np.ndarray | None = None) -> ClosedLoop:
    """Return the loop of modes [rad/s] whose velocities are damped by a matrix [1/s], and swapped by one."""
    n = len(omega)
    w, still = np.diag(omega), np.zeros((n, n))
    coupling = still if swap is None else swap
    A = expm(DT * np.block([[still, w], [-w, -damping + coupling]]))
    names = tuple(f"mode_{k + 1}" for k in range(n))
    none = np.zeros((2 * n, n))
    early = np.zeros((9, 2 * n, n))
    plant = FullPlant(names, np.array(omega), A, none, early, np.zeros((0, 2 * n)), np.zeros((0, n)), still)
    return ClosedLoop(A, np.zeros((n, 2 * n)), plant, none, early)


def examined(loop: ClosedLoop, ordinary: ClosedLoop | None = None) -> ShortCase:
    quiet = loop_of(loop.plant.omega.tolist(), np.eye(len(loop.plant.omega)))
    (case,) = examine_short({0.1: loop}, [ordinary or quiet], POSE, LASTS, DT)
    return case


@pytest.mark.parametrize("sigma", [-2.0, 0.5, 1.5])
def test_an_oscillator_grows_by_the_exponential_of_its_rate(sigma: float) -> None:
    """With w' = omega r', r'' = 2 sigma r' - omega^2 r: amplitude e^{sigma t}, a ripple of sigma / omega."""
    case = examined(loop_of([80.0], np.array([[-2 * sigma]])))
    assert case.growth == pytest.approx(math.exp(sigma * LASTS), rel=1e-9)
    expected = math.exp(sigma * (LASTS if sigma > 0 else DT))
    assert case.kicked["mode_1"] == pytest.approx(expected, rel=2.5 * abs(sigma) / 80.0)
    assert (case.mode, case.frequency_error, case.lasts) == ("mode_1", 0.1, LASTS)
    assert case.frequency == pytest.approx(80.0 / HZ, rel=1e-3)


def test_vibration_handed_from_mode_to_mode_is_seen_though_every_motion_dies_out() -> None:
    """Mode 2 pushes mode 1 at nearly its frequency: no eigenvalue tells, many simulated kicks do."""
    push = np.array([[0.0, 20.0], [0.0, 0.0]])
    loop = loop_of([50.0, 51.0], np.eye(2), push)
    case = examined(loop)
    largest = 0.0
    for phase in np.linspace(0.0, np.pi, 181):
        z = np.array([0.0, math.cos(phase), 0.0, math.sin(phase)])  # mode 2, unit energy
        for _ in range(round(LASTS / DT)):
            z = loop.A @ z
            largest = max(largest, float(np.linalg.norm(z)))
    assert case.growth < 1.0
    assert case.kicked["mode_2"] == pytest.approx(largest, rel=1e-3)
    assert largest > 3.0 and case.kicked["mode_1"] < 1.0


def test_what_the_ordinary_law_lets_grow_as_well_is_not_the_firm_laws_fault() -> None:
    growing = loop_of([80.0], np.array([[-6.0]]))
    assert examined(growing).kicked["mode_1"] == pytest.approx(math.exp(3.0 * LASTS), rel=0.1)
    case = examined(growing, ordinary=growing)
    assert case.kicked["mode_1"] == pytest.approx(1.0)
    assert case.growth == pytest.approx(math.exp(3.0 * LASTS))


def case_of(growth: float, **kicked: float) -> ShortCase:
    return ShortCase((0.2,), -0.1, 0.6, growth, "mode_2", 33.0, kicked)


def test_the_gate_names_what_grows_most_and_by_how_much() -> None:
    config = MarginConfig()
    assert firm_verdict([], config) == "" == firm_verdict([case_of(1.9, mode_1=2.0)], config)
    grows = firm_verdict([case_of(2.5, mode_1=2.2), case_of(2.1)], config)
    assert grows.startswith("margins: firm law: mode 2 grows by 2.5 at 33 Hz within 0.6 s, 2 is allowed")
    assert "frequencies -10 %, pose (0.2)" in grows
    assert "mode 1, once kicked" in firm_verdict([case_of(2.5, mode_1=3.0)], config)
    assert len(firm_shortfalls([case_of(2.5, mode_1=2.2), case_of(2.1)], config)) == 3


def test_what_is_not_a_number_is_no_reason_to_move() -> None:
    assert "mode 1" in firm_verdict([case_of(1.0, mode_1=math.nan)], MarginConfig())
