"""Faults of the simulated sensors: what each kind does to samples, what it leaves alone, and its text."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.sensor_fault_text import faults_text, parse_faults
from flexarm_bringup.sim.sensor_faults import KINDS, Arrival, FaultLine, SensorFault
from flexarm_model.manipulator.sensor_kinds import POSE_CHANNELS
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError

DT = 0.005  # s
GAUGE = SensorSpec("gauge", "strain_gauge", "strip.root", ("strain",), np.array([1e-6]))
CAMERA = SensorSpec("camera", "camera", "tip", POSE_CHANNELS, np.full(6, 1e-3), rate_hz=50.0)
SENSORS = (GAUGE, CAMERA, SensorSpec("motor", "encoder", "base.rz", ("position",), np.array([1e-5])))
N = 400  # ticks


def carried(fault: SensorFault, spec: SensorSpec = GAUGE, seed: int = 1) -> list[Arrival]:
    """Send a ramp through a faulty line: the value of tick k is k in every channel."""
    line = FaultLine(fault, spec, DT, seed)
    sent = [Arrival(k, Sample(spec.name, spec.kind, k, np.full(spec.sigma.size, float(k)))) for k in range(N)]
    return [arrival for one in sent for arrival in line.carry(one)]


def values(fault: SensorFault, spec: SensorSpec = GAUGE) -> np.ndarray:
    return np.array([arrival.sample.y for arrival in carried(fault, spec)])


def test_a_fault_acts_between_start_and_end_only() -> None:
    ticks = [arrival.sample.tick for arrival in carried(SensorFault("off", start=0.5, end=1.0))]
    assert ticks == [*range(100), *range(200, N)]


def test_a_stuck_sensor_repeats_its_first_value_with_new_stamps() -> None:
    arrivals = carried(SensorFault("stuck", start=0.5))
    assert [arrival.sample.tick for arrival in arrivals] == list(range(N))
    assert {arrival.sample.y[0] for arrival in arrivals[100:]} == {100.0}


def test_spikes_hit_their_share_of_the_samples_by_their_size() -> None:
    off = np.abs(values(SensorFault("garbage", share=0.1, spike=50.0))[:, 0] - np.arange(N))
    hit = off > 0.0
    assert np.allclose(off[hit], 50e-6, rtol=1e-6)  # rounding of 400 + 50e-6
    assert abs(hit.sum() - 40) < 4 * math.sqrt(40 * 0.9)  # binomial, four sigmas


@pytest.mark.parametrize("ramp", [0.0, 0.5])
def test_a_bias_begins_whatever_rounding_makes_of_its_start(ramp: float) -> None:
    """A step that began a rounding after its sample was divided by its ramp of no length."""
    for k in range(60, 120):
        for start in (k * DT, k * DT + 5e-10, k * DT - 5e-10):
            off = values(SensorFault("bias", start=start, bias=0.25, ramp=ramp))[:, 0] - np.arange(N)
            assert off[k - 1] == 0.0 and off[N - 1] == 0.25
            assert off[k] == pytest.approx(0.0 if ramp else 0.25, abs=1e-6)


def test_a_wrong_unit_of_a_pose_reaches_its_position_only() -> None:
    y = values(SensorFault("wrong", factor=1000.0), CAMERA)[7]
    assert y.tolist() == [7000.0] * 3 + [7.0] * 3


def test_a_wrong_sensor_saturates_stamps_late_and_takes_another_name() -> None:
    last = carried(SensorFault("wrong", limit=300.0, stamp=-0.05, named="motor"))[-1].sample
    assert (last.y[0], last.tick, last.sensor) == (300.0, N - 1 - 10, "motor")


def test_a_slow_sensor_keeps_its_rate() -> None:
    ticks = [arrival.sample.tick for arrival in carried(SensorFault("slow", rate_hz=5.0))]
    assert ticks == list(range(0, N, 40))


def test_a_delay_moves_the_arrival_and_not_the_stamp() -> None:
    late = carried(SensorFault("delayed", delay=0.06, jitter=0.02))
    delays = np.array([arrival.tick - arrival.sample.tick for arrival in late])
    assert (delays.min(), delays.max()) == (9, 16)  # heard at the first tick after 40 to 80 ms
    assert abs(delays.mean() - 12.5) < 0.5


@pytest.mark.parametrize(("delay", "ticks"), [(0.0, 0), (0.06, 12), (0.0601, 13), (0.0575, 12)])
def test_no_sample_is_heard_before_it_has_come(delay: float, ticks: int) -> None:
    faulty = carried(SensorFault("delayed", delay=delay))
    assert {arrival.tick - arrival.sample.tick for arrival in faulty} == {ticks}
    config = load_config(find_manipulator("single_link"))
    (camera,) = (replace(spec, latency=delay) for spec in config.sensors if spec.kind == "camera")
    rig = Rig(replace(config, sensors=(camera,)))
    heard = [(rig.tick, sample.tick) for _ in range(40) for sample in rig.rest()]
    assert heard and {now - taken for now, taken in heard} == {ticks}


@pytest.mark.parametrize("error", [-0.0426, -0.05, 0.0, 1e-9, 0.0624])
def test_a_wrong_stamp_is_off_to_the_nanosecond(error: float) -> None:
    config = load_config(find_manipulator("single_link"))
    rig = Rig(config, faults={"encoder": SensorFault("wrong", stamp=error)})
    for sample in rig.rest():
        off = rig.time_of(sample.tick, sample.late_ns) - rig.dt
        assert off == pytest.approx(error if sample.sensor == "encoder" else 0.0, abs=1e-12)


def test_an_intermittent_sensor_is_silent_for_its_share_of_every_period() -> None:
    ticks = {a.sample.tick for a in carried(SensorFault("intermittent", period=0.5, share=0.2))}
    assert ticks == {k for k in range(N) if k % 100 >= 20}


def test_a_bias_grows_over_its_ramp_on_the_first_channel() -> None:
    off = values(SensorFault("bias", start=0.5, bias=2.0, ramp=0.5), CAMERA) - np.arange(N)[:, None]
    assert off[:100].max() == 0.0 and off[:, 1:].max() == 0.0
    assert off[150, 0] == pytest.approx(1.0) and off[250, 0] == pytest.approx(2.0)


def test_a_number_that_is_none_fills_every_channel() -> None:
    y = values(SensorFault("nan", share=0.5), CAMERA)
    hit = np.isnan(y).any(axis=1)
    assert np.isnan(y[hit]).all() and 100 < hit.sum() < 300


def test_a_line_counts_what_it_touched() -> None:
    line = FaultLine(SensorFault("nan", start=0.5, end=1.0), GAUGE, DT, 1)
    for k in range(N):
        line.carry(Arrival(k, Sample("gauge", "strain_gauge", k, np.zeros(1))))
    assert line.touched == 100


def test_a_fault_changes_no_bit_of_the_other_sensors_and_not_its_own_noise() -> None:
    config = load_config(find_manipulator("single_link"), "geared")
    spikes = {"root_strain": SensorFault("garbage", share=0.5, end=0.5)}
    sound = Rig(config, RigSettings(seed=3))
    usual = [sound.step(np.array([0.5])) for _ in range(200)]
    faulty = Rig(config, RigSettings(seed=3), sound.plant, spikes)
    assert faulty.faults == spikes and not sound.faults
    pairs = [pair for told in usual for pair in zip(told, faulty.step(np.array([0.5])), strict=True)]
    changed = [(a.sensor, a.tick) for a, b in pairs if not np.array_equal(a.y, b.y)]
    assert {sensor for sensor, _ in changed} == {"root_strain"}
    assert max(tick for _, tick in changed) < 100


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SensorFault("odd"), "odd.*is not one of ok, off, stuck"),
        (lambda: SensorFault("off", start=2.0, end=1.0), "0 <= start < end"),
        (lambda: SensorFault("nan", share=1.5), r"share 1.5 is not in \[0, 1\]"),
        (lambda: SensorFault("slow", rate_hz=0.0), "rate_hz 0 must be above 0"),
        (lambda: SensorFault("delayed", delay=math.inf), "delay inf must be finite"),
    ],
)
def test_a_fault_that_cannot_be_meant_is_refused(make: Callable[[], SensorFault], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()


def test_faults_are_read_from_a_line_of_text() -> None:
    text = "gauge: off 1.0 3.0; camera: delayed 60 ms jitter 20 ms; motor: wrong factor 57.3 limit 10 deg"
    expected = {
        "gauge": SensorFault("off", 1.0, 3.0),
        "camera": SensorFault("delayed", delay=0.06, jitter=0.02),
        "motor": SensorFault("wrong", factor=57.3, limit=math.radians(10.0)),
    }
    found = parse_faults(text, SENSORS)
    # as dictionaries: from Python 3.13 on a dataclass with a NaN equals no other
    assert {name: asdict(it) for name, it in found.items()} == {n: asdict(it) for n, it in expected.items()}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("elbow: off", "'elbow: off': must begin with one of gauge, camera, motor"),
        ("gauge: broken", "gauge: kind 'broken' is not one of ok, off"),
        ("gauge: off 3 1", "gauge: off: start 3 s, end 1 s"),
        ("gauge: off 1 2 3", "end is given twice"),
        ("gauge: bias 3 mm", "gauge: bias: .*unit 'mm' is not one of strain.*m/m, ustrain"),
        ("camera: delayed period 3 s", "'period' is not one of its settings: START, END, delay, jitter"),
        ("motor: wrong named elbow", "named 'elbow' is not one of motor"),
        ("camera: wrong named gauge", "named 'gauge' is not one of camera"),
        ("gauge: off; gauge: ok", "'gauge' is given twice"),
        ("gauge: nan value many", "value 'many'"),
    ],
)
def test_text_that_cannot_be_understood_names_sensor_kind_and_what_is_allowed(text: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        parse_faults(text, SENSORS)


NUMBERS = st.floats(0.001, 1e6, allow_nan=False)


@given(
    st.sampled_from(KINDS),
    st.builds(
        dict,
        start=st.floats(0.0, 10.0),
        end=st.floats(11.0, 20.0),
        share=st.floats(0.0, 1.0),
        spike=NUMBERS,
        factor=st.floats(-1e6, 1e6),
        limit=NUMBERS,
        named=st.sampled_from(["", "gauge"]),
        stamp=st.floats(-100.0, 100.0),
        rate_hz=NUMBERS,
        delay=NUMBERS,
        jitter=NUMBERS,
        period=NUMBERS,
        bias=st.floats(-1.0, 1.0),
        ramp=NUMBERS,
        value=st.sampled_from([math.nan, math.inf, -1e308]),
    ),
)
def test_text_and_faults_agree_both_ways(kind: str, settings: dict[str, float]) -> None:
    """Settings that a kind does not read are not written, so one round decides."""
    text = faults_text({"gauge": SensorFault(kind, **settings)}, SENSORS)  # type: ignore[arg-type]
    assert faults_text(parse_faults(text, SENSORS), SENSORS) == text
