import math
from dataclasses import replace

import numpy as np
import pytest
from planar_strip import ENCODER

from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.judging.sample_judge import FAR
from flexarm_estimator.judging.short_term import HELD, SHIFT
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

CONFIG = EstimatorConfig()


def verdict(gate, sensor, sigmas, t, size=1):
    nu = np.full(size, sigmas / math.sqrt(size))
    return gate.judge(sensor, t, nu, np.eye(size))


def refuse(gate, sensor, t, times=CONFIG.reopen_after):
    for i in range(times):
        gate.note([verdict(gate, sensor, 9.0, t + 0.005 * i)])


def test_five_sigma_is_the_edge_of_a_scalar():
    gate = Gate({"a": [1.0]}, CONFIG)
    assert verdict(gate, "a", 4.99, 0.0).is_accepted
    assert not verdict(gate, "a", 5.01, 0.0).is_accepted


def test_the_gate_of_a_vector_is_as_improbable_as_that_of_a_scalar():
    gate = Gate({"pose": [1.0] * 6}, CONFIG)
    rng = np.random.default_rng(1)
    accepted = [gate.judge("pose", 0.0, nu, np.eye(6)).is_accepted for nu in rng.normal(size=(5000, 6))]
    assert all(accepted)  # 5 sigma: six in ten million are refused
    edge = 6.285  # closed form of 6 degrees: exp(-z) (1 + z + z^2/2) = 5.7e-7 at z = 6.285^2 / 2
    z = edge**2 / 2
    assert math.exp(-z) * (1 + z + z**2 / 2) == pytest.approx(math.erfc(5 / math.sqrt(2)), rel=0.02)
    assert verdict(gate, "pose", edge - 0.01, 0.0, 6).is_accepted
    assert not verdict(gate, "pose", edge + 0.01, 0.0, 6).is_accepted


@pytest.mark.parametrize("S", [-np.eye(2), np.zeros((2, 2)), np.full((2, 2), np.nan)])
def test_a_covariance_that_is_none_refuses(S):
    gate = Gate({"a": [1.0] * 2}, CONFIG)
    result = gate.judge("a", 0.0, np.ones(2), S)
    assert not result.is_accepted
    assert math.isfinite(result.normalised)


def test_doubt_comes_with_the_sixth_refusal_in_a_row():
    gate = Gate({"a": [1.0]}, CONFIG)
    for _ in range(CONFIG.reopen_after):
        last = verdict(gate, "a", 9.0, 0.0)
        assert not gate.has_doubt([last], 0.0)
        gate.note([last])
    assert gate.has_doubt([verdict(gate, "a", 9.0, 0.0)], 0.0)
    gate.note([verdict(gate, "a", 1.0, 0.0)])
    assert not gate.has_doubt([verdict(gate, "a", 9.0, 0.0)], 0.0)


@pytest.mark.parametrize(("second", "times"), [("a", 1), ("b", 2)])
def test_who_refuses_on_soon_after_a_doubt_disputes_it(second, times):
    """One refusal of a sensor that speaks all the time may be a spike; a slow one's does not wait."""
    gate = Gate({"a": [1.0], "b": [1.0]}, CONFIG, specs={"a": replace(ENCODER, rate_hz=30.0)})
    refuse(gate, "a", 0.0)
    gate.note_reopening([verdict(gate, "a", 9.0, 0.1)], 0.1)
    gate.note([verdict(gate, "a", 1.0, 0.1)])
    assert (gate.is_disputed, gate.doubters, gate.doubted_since) == (False, {"a"}, 0.0)
    assert "a" in gate.doubt(0.2)
    for k in range(times):
        assert not gate.is_disputed
        gate.note([verdict(gate, second, 9.0, 0.2 + 0.005 * k)])
    assert gate.is_disputed
    gate.calm()
    assert not gate.is_disputed
    assert gate.doubt(0.2) == ""


def test_two_that_refuse_at_once_soon_after_a_doubt_do_not_wait():
    """A tap on the tip: gauge and accelerometer swing through what is expected, never far twice in a row."""
    gate = Gate({"a": [1.0], "b": [1.0]}, CONFIG)
    both = [verdict(gate, name, 9.0, 0.1) for name in ("a", "b")]
    assert not gate.has_doubt(both, 0.1)
    refuse(gate, "a", 0.0)
    gate.note_reopening([verdict(gate, "a", 9.0, 0.1)], 0.1)
    gate.note([verdict(gate, "a", 1.0, 0.1)])
    for t, has_doubt in ((0.2, True), (0.1 + 1.01 * CONFIG.reopen_interval, False)):
        assert not gate.has_doubt([verdict(gate, "b", 9.0, t)], t)
        assert gate.has_doubt([verdict(gate, name, 9.0, t) for name in ("a", "b")], t) is has_doubt


def test_what_moved_the_arm_did_so_since_the_first_of_the_doubts_in_a_row():
    """As if the blow had come a moment ago, velocities and torques were let free at every doubt after it."""
    gate = Gate({"a": [1.0], "b": [1.0]}, CONFIG)
    refuse(gate, "a", 0.0)
    assert gate.note_reopening([verdict(gate, "a", 9.0, 0.1)], 0.1) == ({"a"}, pytest.approx(0.1))
    gate.note([verdict(gate, "a", 1.0, 0.1)])
    both = [verdict(gate, name, 9.0, 0.2) for name in ("a", "b")]
    assert gate.note_reopening(both, 0.2) == ({"a", "b"}, pytest.approx(0.2))
    later = 0.2 + 1.01 * CONFIG.reopen_interval
    refuse(gate, "b", later - 0.05)
    assert gate.note_reopening([verdict(gate, "b", 9.0, later)], later)[1] == pytest.approx(0.05)


def test_two_impacts_far_apart_are_no_dispute():
    gate = Gate({"a": [1.0]}, CONFIG)
    for t in (0.0, 5.0):
        refuse(gate, "a", t)
        result = [verdict(gate, "a", 9.0, t)]
        assert gate.has_doubt(result, t)
        gate.note_reopening(result, t)
        gate.note([verdict(gate, "a", 1.0, t)])
        assert not gate.is_disputed


@pytest.mark.parametrize("size", [1, 2])
def test_an_innovation_too_large_to_be_squared_is_refused(size):
    gate = Gate({"a": [1.0] * size}, CONFIG)
    with np.errstate(over="ignore"):
        assert not gate.judge("a", 0.0, np.full(size, 1e200), np.eye(size)).is_accepted


@pytest.mark.parametrize(("lone_gate", "is_held"), [(0.0, False), (8.0, True)])
def test_a_sensor_alone_may_have_a_narrower_gate(lone_gate, is_held):
    """Ten sigma at once, in a gate of 25: let through, unless what comes alone is judged by itself."""
    gate = Gate({"a": [1.0], "b": [1.0]}, EstimatorConfig(gate=25.0, lone_gate=lone_gate))
    held = gate._past["a"].record.jump < 10.0
    assert held is is_held


def say(gate, sensor, t, sigmas):
    """Let a sensor say something new, and return why it is not fused."""
    gate.meet([Measurement(sensor, t, np.array([t]))])
    told = gate.judge(sensor, t, np.array([sigmas]), np.eye(1))
    gate.note([told])
    return told.reason


def test_a_jump_is_not_the_arms_because_the_mean_of_another_sensor_is_a_little_off():
    """An encoder whose sign flipped in a move was followed for 0.1 s: the camera's mean had 3.1 sigmas."""
    rng, t = np.random.default_rng(2), 0.0
    gate = Gate({"encoder": [1.0], "camera": [1.0]}, CONFIG)
    while t < 5.0 and gate._past["camera"].mean.score < 3.1:
        t += 0.005
        assert not say(gate, "encoder", t, 0.3 * rng.normal())
        say(gate, "camera", t, 1.5 + 0.3 * rng.normal())
    assert gate._past["camera"].mean.score >= 3.1
    assert [say(gate, "encoder", t + 0.005 * k, 1e4) for k in (1, 2, 3)] == [HELD, HELD, SHIFT]


def test_a_jump_of_a_few_sigmas_may_be_the_arms_when_another_mean_leaves_zero():
    """With frequencies 10 % off a fast move took a sound gauge out of use, for 11.5 sigmas beside 3.4."""
    rng, t = np.random.default_rng(2), 0.0
    gate = Gate({"strain": [1.0], "encoder": [1.0]}, CONFIG)
    while t < 5.0 and gate._past["encoder"].mean.score < 3.3:
        t += 0.005
        assert not say(gate, "strain", t, 0.3 * rng.normal())
        say(gate, "encoder", t, 1.5 + 0.3 * rng.normal())
    assert gate._past["encoder"].mean.score >= 3.3
    assert [say(gate, "strain", t + 0.005 * k, 11.5) for k in (1, 2)] == [HELD, HELD]
    assert say(gate, "strain", t + 0.015, 11.5) not in (HELD, SHIFT)


@pytest.mark.parametrize(("later", "reasons"), [(0.005, [HELD, HELD, FAR]), (0.2, [HELD, HELD, SHIFT])])
def test_a_jump_while_the_state_settles_is_not_the_gauges(later, reasons):
    """Encoders that had been silent moved the state, and a gauge that said the same as ever had shifted."""
    rng, t = np.random.default_rng(2), 0.0
    gate = Gate({"strain": [1.0], "encoder": [1.0]}, CONFIG)
    while t < 1.0:
        t += 0.005
        assert not say(gate, "strain", t, 0.3 * rng.normal())
    gate.note_return(t)
    gate.note_return(-np.inf)  # nobody has since
    assert [say(gate, "strain", t + later + 0.005 * k, 11.5) for k in range(3)] == reasons


def test_a_held_sample_that_has_become_too_old_is_let_go_nowhere():
    """The instant that it belongs to is forgotten by then: the history takes only later ones."""
    rng, gate = np.random.default_rng(1), Gate({"a": [1.0]}, CONFIG)
    times = 0.005 * np.arange(1, 204)
    for t in times[:200]:
        assert not say(gate, "a", t, 0.3 * rng.normal())
    reasons = [say(gate, "a", t, size) for t, size in zip(times[200:], (6.0, 20.0, 4.5), strict=True)]
    assert reasons == [HELD, HELD, ""]
    released, dropped = gate.resolve(times[200])
    assert [sample.t for sample in released] == [times[201]]
    assert not dropped
