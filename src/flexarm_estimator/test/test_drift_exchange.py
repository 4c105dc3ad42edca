"""The drift watch between messages: instants out of order, models, what it says on /diagnostics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from planar_strip import DT, Record, simulate

from flexarm_estimator.drift.conversions import drift_from_msg, drift_to_msg
from flexarm_estimator.drift.exchange import DriftExchange
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import model_to_msg
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

SINGLE_LINK = Path(__file__).parents[2] / "flexarm_bringup" / "config" / "manipulators" / "single_link.yaml"
QUIET = EstimatorConfig(frequency_error=0.005, modal_force=0.01)
CONFIG = load_config(SINGLE_LINK, "geared")
NS = round(1e9 * DT)


@pytest.fixture(scope="module")
def model() -> ReducedModel:
    return linearize(ReducedTree(CONFIG, use_compiler=False))


@pytest.fixture(scope="module")
def record(model: ReducedModel) -> Record:
    """Three seconds of the served model itself, all its frequencies 5 % lower."""
    K = model.K.copy()
    K[1:, 1:] *= 0.95**2
    return simulate(600, np.random.default_rng(0), model=replace(model, K=K), config=QUIET)


def header(stamp_ns: int, frame: str = "base") -> SimpleNamespace:
    stamp = SimpleNamespace(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return SimpleNamespace(stamp=stamp, frame_id=frame)


def messages(record: Record, k: int) -> list[tuple[str, Any]]:
    """Return what arrives at instant k; the torque that acts from it on is that of the next one."""
    y = {sample.sensor: float(sample.y[0]) for sample in record.samples[k]}
    joints = {"name": ["base.rz"], "velocity": [], "effort": []}
    nothing = [0.0] * 9
    told = [("joint_states", SimpleNamespace(header=header(k * NS), position=[y["encoder"]], **joints)),
            ("strain", SimpleNamespace(header=header(k * NS), names=["root_strain"],
                                       strain=[y["root_strain"]], standard_deviation=[])),
            ("imu/tip_accelerometer", SimpleNamespace(
                header=header(k * NS, "strip.sensor"), linear_acceleration_covariance=nothing,
                linear_acceleration=SimpleNamespace(x=0.0, y=y["tip_accelerometer"], z=0.0)))]  # fmt: skip
    if k + 1 < len(record.t):
        effort = {
            "name": ["base.rz"],
            "position": [],
            "velocity": [],
            "effort": [float(record.tau[k + 1, 0])],
        }
        told.append(("applied_effort", SimpleNamespace(header=header(k * NS), **effort)))
    return told


def play(exchange: DriftExchange, record: Record, late: int = 0) -> DriftExchange:
    """Feed a record; gauges and accelerometers come ``late`` instants after the encoders."""
    for k in range(len(record.t) + late):
        for topic, msg in messages(record, k) if k < len(record.t) else []:
            if not late or topic in ("joint_states", "applied_effort"):
                exchange.on_sensor(topic, msg)
        if late and 0 <= k - late < len(record.t):
            for topic, msg in messages(record, k - late):
                if topic not in ("joint_states", "applied_effort"):
                    exchange.on_sensor(topic, msg)
    return exchange


def started(model: ReducedModel) -> DriftExchange:
    exchange = DriftExchange(CONFIG, QUIET)
    exchange.on_model(model_to_msg(model, 0))
    assert not exchange.fault
    return exchange


def test_messages_of_a_softer_arm_lead_to_a_warning_with_numbers(model, record) -> None:
    exchange = play(started(model), record)
    msg = drift_to_msg(exchange.watch, exchange.fault, 10**9)
    first = drift_from_msg(msg)[0]
    assert first.name == "mode_1" and first.has_drifted and "Hz" in first.text
    described, running, sigma = first.numbers[:3]
    assert running / described == pytest.approx(0.95, abs=0.01) and sigma < 0.02 * described
    assert any(pair.key == "proposal" and "stiffness" in pair.value for pair in msg.status[0].values)


def test_sensors_that_come_later_than_the_encoders_are_put_in_their_instant(model, record) -> None:
    """Five instants late, within the patience: the same numbers but for the last five."""
    prompt, late = (play(started(model), record, by).watch for by in (0, 5))
    assert prompt is not None and late is not None
    assert late.modes[0].f_hz == pytest.approx(prompt.modes[0].f_hz, rel=1e-9)


def test_what_queued_in_a_standstill_and_comes_topic_by_topic_is_put_together_again(model, record) -> None:
    """As after 0.3 s without a turn: first all encoders, then all gauges, the torques last."""
    prompt, queued = play(started(model), record).watch, started(model)
    order = ("joint_states", "strain", "imu/tip_accelerometer", "applied_effort")
    for start in range(0, len(record.t), 60):
        block = [item for k in range(start, min(start + 60, len(record.t))) for item in messages(record, k)]
        for wanted in order:
            for topic, msg in block:
                if topic == wanted:
                    queued.on_sensor(topic, msg)
    assert prompt is not None and queued.watch is not None
    prompt_hz, queued_hz = prompt.modes[0].f_hz, queued.watch.modes[0].f_hz
    assert queued.watch.alarms.keys() == prompt.alarms.keys()
    assert queued_hz == pytest.approx(prompt_hz, rel=0.005)  # its last instants wait for the next block


def test_without_a_model_it_says_so_and_takes_nothing(record) -> None:
    exchange = DriftExchange(CONFIG, QUIET)
    for topic, msg in messages(record, 0):
        exchange.on_sensor(topic, msg)
    msg = drift_to_msg(exchange.watch, exchange.fault, 0)
    assert msg.status[0].message == "no model yet" and not drift_from_msg(msg)


def test_a_model_of_another_description_is_refused(model) -> None:
    exchange = DriftExchange(CONFIG, QUIET)
    exchange.on_model(model_to_msg(replace(model, config_id="another"), 0))
    assert "another" in exchange.fault and exchange.watch is None


def test_the_same_model_again_changes_nothing(model, record) -> None:
    exchange = started(model)
    exchange.on_model(model_to_msg(model, 300 * NS))
    plain = play(started(model), record).watch
    again = play(exchange, record).watch
    assert plain is not None and again is not None
    assert again.modes[0].change == pytest.approx(plain.modes[0].change, abs=1e-9)


def test_a_clock_that_jumps_ahead_and_back_does_not_stop_the_watch(model, record) -> None:
    exchange = play(started(model), record)
    jumped = messages(record, 3)[0][1]
    jumped.header = header(10**12)
    exchange.on_sensor("joint_states", jumped)
    play(exchange, record)
    assert exchange.watch is not None and exchange.watch.modes


def test_after_the_clock_was_set_back_torques_are_those_of_the_new_time(model, record) -> None:
    """One of the old time stood before all new ones, until a thousand had pushed it out."""
    exchange = started(model)
    seen: list[tuple[int, float]] = []
    step = exchange.watch.step
    exchange.watch.step = lambda period, samples, tau: (
        seen.append((period, float(tau[0]))), step(period, samples, tau)
    )  # fmt: skip
    for _ in range(2):
        seen.clear()
        play(exchange, record)
        assert len(seen) > 500
        assert all(tau == record.tau[k, 0] for k, tau in seen[2:] if k < 590)


def test_what_an_arm_does_under_torques_that_nobody_tells_says_nothing_of_its_modes(
    model: ReducedModel, record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The guard was silent and the drives braked by themselves: the last torque was taken for what acted."""
    exchange = DriftExchange(CONFIG, QUIET)
    exchange.on_model(model_to_msg(model, 0))
    assert exchange.watch is not None
    seen: dict[int, bool] = {}
    monkeypatch.setattr(exchange.watch, "step", lambda k, samples, tau: seen.__setitem__(k, bool(samples)))
    for k in range(len(record.t)):
        for topic, msg in messages(record, k):
            if topic != "applied_effort" or not 200 <= k < 320:
                exchange.on_sensor(topic, msg)
    unknown = [k for k, is_used in seen.items() if not is_used]
    assert min(unknown) == 200 + round(0.05 / DT) and max(unknown) == 320
    assert len(unknown) == max(unknown) - min(unknown) + 1
