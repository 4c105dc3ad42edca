"""A sensor that says what its axis cannot have done is no witness against the state, whatever its size."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planar_strip import DT, ENCODER, SENSORS, StripKinematics, arriving, simulate, strip_model
from test_exclusion import FRAMES, status_of

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.judging.sample_judge import FAR
from flexarm_estimator.judging.short_term import HELD, LEAP, ShortTerm
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

CONFIG, VELOCITY = EstimatorConfig(), 3.0  # rad/s
LIMITED = (replace(ENCODER, velocity=VELOCITY, low=-1e3, high=1e3), *SENSORS[1:])
WRONG, RIGHT = 200, 300  # instants
DEGREES = 180.0 / math.pi


def worked(velocity: float = VELOCITY, seed: int = 1) -> tuple[Gate, float, np.random.Generator]:
    """Return the gate of an encoder that has worked for a second, the time, and its noise."""
    gate, rng = (
        Gate({"encoder": [1e-4]}, CONFIG, specs={"encoder": replace(ENCODER, velocity=velocity)}),
        np.random.default_rng(seed),
    )
    for k in range(200):
        assert not say(gate, k * DT, 1e-4 * rng.normal())
    return gate, 200 * DT, rng


def say(gate: Gate, t: float, value: float) -> str:
    """Let it say a value where 0 is expected to 1e-4; return why it is not fused."""
    gate.meet([Measurement("encoder", t, np.array([value]))])
    told = gate.judge("encoder", t, np.array([value]), np.array([[2e-8]]))
    if gate.has_doubt([told], t):
        gate.note_reopening([told], t)
    gate.note([told])
    return told.reason


def moving(k: int) -> float:
    return 5.0 * 2.0**k  # its innovations grow: not off by the same


@pytest.mark.parametrize(("velocity", "last"), [(VELOCITY, LEAP), (math.inf, FAR)])
def test_who_has_leapt_doubts_nothing_and_who_may_have_moved_there_does(velocity: float, last: str) -> None:
    gate, t, _ = worked(velocity)
    said = [say(gate, t + k * DT, moving(k)) for k in range(12)]
    assert said[:2] == [HELD, HELD]
    assert said[-1] == last
    assert bool(gate.doubters) is (last == FAR)


def test_a_spike_of_two_samples_is_no_leap_that_lasts() -> None:
    gate, t, rng = worked()
    assert [say(gate, t + k * DT, 5.0 + 0.1 * k) for k in range(2)] == [HELD, HELD]
    assert [say(gate, t + k * DT, 1e-4 * rng.normal()) for k in range(2, 9)] == [""] * 7
    assert [say(gate, t + k * DT, moving(k)) for k in range(9, 12)] == [HELD, HELD, LEAP]


@pytest.mark.parametrize(("silence", "has_leapt"), [(0.01, True), (0.5, False)])
def test_how_far_it_can_have_moved_hangs_on_how_long_it_has_said_nothing_new(
    silence: float, has_leapt: bool
) -> None:
    """Off by 1 rad: at four times 3 rad/s that takes 83 ms, whether it was silent or repeated itself."""
    for repeats in (False, True):
        past = ShortTerm([1e-4], 5.0, velocity=VELOCITY)
        for t in (0.0, 0.5 * silence) if repeats else (0.0,):
            past.meet(Measurement("encoder", t, np.array([0.2])))
        past.meet(Measurement("encoder", silence, np.array([1.2])))
        assert bool(past.record.leaps) is has_leapt


@pytest.mark.parametrize("use_compiler", [True, False])
@pytest.mark.parametrize("factor", [DEGREES, -1.0])
def test_an_encoder_of_a_wrong_unit_is_named_at_once_and_heard_again_when_it_is_right(
    factor: float, use_compiler: bool
) -> None:
    """It was refused five times, moved the state by radians in the next period, and the tip by metres."""
    start = np.zeros(9)
    start[0], start[4] = 0.6, 0.5
    record = simulate(400, np.random.default_rng(3), x0=start, camera_every=7)
    estimator = Estimator(strip_model(), StripKinematics(), LIMITED, CONFIG, use_compiler=use_compiler)
    statuses, errors = [], []
    for k, t in enumerate(record.t):
        lie = factor if WRONG <= k < RIGHT else 1.0
        samples = [
            s._replace(y=s.y * lie) if s.sensor == "encoder" else s for s in arriving(record, k, FRAMES)
        ]
        told = estimator.step(samples, record.tau[k], float(t))
        truth = StripKinematics().tip_pose(record.x[k][:4])[:3, 3]
        errors.append(float(np.linalg.norm(told.T_world_tip[:3, 3] - truth)))
        statuses.append(status_of(told, "encoder"))
        assert told.status in (("degraded", "ok") if k > 60 else ("starting", "degraded", "ok"))
    assert set(statuses[WRONG + 3 : RIGHT]) == {"faulty"}
    assert set(statuses[-20:]) == {"ok"}
    assert max(errors[60:WRONG]) < 2e-3
    assert max(errors[WRONG:]) < 4e-3
