"""The sensor check: every fault that can be planted gets its own verdict, a good channel keeps its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexarm_model.identification.channel_findings import ANOTHER_ARM, CheckedChannel, Finding, Pushes
from flexarm_model.identification.noise_floor import noise_floor
from flexarm_model.identification.sensor_check import check_channels

SIGMA = 0.01
CHANNELS = tuple(CheckedChannel(name, "m/s^2", SIGMA, -50.0, 50.0) for name in ("a", "b", "c"))


def pushes(seed: int = 0, frequency: float = 1.0) -> Pushes:
    """Return three channels that answer differently to two motors; ``frequency`` is over the model's."""
    rng, t = np.random.default_rng(seed), np.linspace(0.0, 1.5, 300)
    shapes = np.array([[1.0, 0.3, 0.2], [0.1, -0.8, 0.9]])  # (motors, channels)
    own = np.exp(-t) * np.sin(2 * np.pi * t)
    real = np.exp(-t) * np.sin(2 * np.pi * frequency * t)
    predicted = shapes[:, None, :] * own[:, None]
    measured = shapes[:, None, :] * real[:, None] + SIGMA * rng.standard_normal((2, 300, 3))
    return Pushes(SIGMA * rng.standard_normal((400, 3)), np.zeros((2, 3)), measured, predicted)


def found(planted: Pushes) -> dict[str, Finding]:
    return {finding.name: finding for finding in check_channels(CHANNELS, planted)}


def changed(**channels: object) -> Pushes:
    """Return pushes with channels changed by functions of (quiet, measured)."""
    clean = pushes()
    quiet, measured = clean.quiet.copy(), clean.measured.copy()
    for name, change in channels.items():
        c = "abc".index(name)
        quiet[:, c], measured[:, :, c] = change(quiet[:, c]), change(measured[:, :, c])  # type: ignore[operator]
    return replace(clean, quiet=quiet, measured=measured)


def test_good_channels_are_good_on_an_arm_whose_frequency_is_15_percent_off() -> None:
    assert {f.verdict for f in found(pushes(frequency=0.85)).values()} == {"good"}


@pytest.mark.parametrize(
    ("verdict", "change"),
    [
        ("flipped", lambda y: -y),
        ("dead", lambda y: 0.0 * y),
        ("dead", lambda y: 0.03 * y),
        ("clipped", lambda y: np.clip(y, -0.3, 0.3)),
        ("silent", lambda y: np.where(np.arange(y.shape[-1]) % 2, np.nan, y)),
        ("wrong size", lambda y: 9.81 * y),
        ("wrong size", lambda y: 2.0 * y),
        ("wrong size", lambda y: 0.5 * y),
    ],
)
def test_a_fault_is_told_by_name_and_the_other_channels_stay_good(verdict: str, change: object) -> None:
    verdicts = {name: f.verdict for name, f in found(changed(a=change)).items()}
    assert verdicts == {"a": verdict, "b": "good", "c": "good"}


@pytest.mark.parametrize(("factor", "verdict"), [(1.3, "good"), (2.0, "wrong size"), (0.5, "wrong size")])
def test_what_all_channels_are_off_by_is_told_of_the_arm_and_no_sensor(factor: float, verdict: str) -> None:
    """Half the torque constant: every channel was good; a gauge factor of two beside it would hide in it."""
    findings = found(changed(a=lambda y: factor * y, b=lambda y: factor * y, c=lambda y: factor * y))
    assert {f.verdict for f in findings.values()} == {verdict}
    assert all(("torque" in f.words) == (verdict != "good") for f in findings.values())


def test_an_arm_that_hardly_answers_is_another_arm_and_its_sensors_are_not_dead() -> None:
    """The description of another preset: encoder, gauge and accelerometer were to be repaired."""
    clean = pushes()
    weak = clean.measured - 0.9 * clean.predicted
    assert {f.verdict for f in found(replace(clean, measured=0.1 * weak)).values()} == {ANOTHER_ARM}
    one_speaks = np.where([True, False, False], clean.measured, 0.1 * weak)
    verdicts = [f.verdict for f in found(replace(clean, measured=one_speaks)).values()]
    assert verdicts == ["good", "dead", "dead"]


@pytest.mark.parametrize(("standing", "verdict"), [(9.8, "good"), (7.0, "good"), (0.0, "off at rest")])
def test_a_channel_is_held_against_what_the_model_says_at_rest(standing: float, verdict: str) -> None:
    """Gravity missing in the description: the check was content, the sound accelerometer accused later."""
    clean = pushes()
    there = replace(clean, quiet=clean.quiet + [9.8, 0.0, 0.0], rest=clean.rest + [9.8, 0.0, 0.0])
    channels = (replace(CHANNELS[0], standing=standing, allowance=4.0), *CHANNELS[1:])
    first, *others = check_channels(channels, there)
    assert first.verdict == verdict and {f.verdict for f in others} == {"good"}
    assert ("gravity" in first.words) == first.is_refused == (verdict != "good")


@pytest.mark.parametrize("likeness", [0.6, 0.8, 0.85])
def test_gauges_that_are_alike_are_swapped_when_exchanged_and_good_when_not(likeness: float) -> None:
    """Both gauges of one beam are still rather like their own predictions: they were good."""
    rng = np.random.default_rng(6)
    a, other, c = np.linalg.qr(rng.standard_normal((600, 3)))[0].T
    b = likeness * a + np.sqrt(1 - likeness**2) * other
    predicted = np.stack([a, b, c], axis=1).reshape(2, 300, 3)
    measured = predicted + 0.15 * np.roll(predicted, 7, axis=1)  # of an arm that is not quite the model
    noise = 1e-3 * rng.standard_normal((400, 3))
    channels = [CheckedChannel(name, "1", 1e-3) for name in "abc"]
    for order, verdicts in (([0, 1, 2], ["good"] * 3), ([1, 0, 2], ["swapped", "swapped", "good"])):
        told = Pushes(noise, np.zeros((2, 3)), measured[:, :, order], predicted)
        assert [f.verdict for f in check_channels(channels, told)] == verdicts


def test_a_range_without_zero_is_one_of_values_and_not_of_deviations() -> None:
    """A sound encoder of an axis that turns from 60 to 120 degrees was called clipped."""
    clean = pushes()
    there = replace(clean, quiet=clean.quiet + 2.0, rest=clean.rest + 2.0)
    for low, high, verdict in ((0.9, 3.1, "good"), (-3.1, -0.9, "clipped"), (0.9, 2.5, "clipped")):
        channels = [replace(channel, low=low, high=high) for channel in CHANNELS]
        assert check_channels(channels, there)[0].verdict == verdict


def test_swapped_channels_are_named_with_whom_they_speak_for() -> None:
    clean = pushes()
    order = [1, 0, 2]
    swapped = replace(clean, quiet=clean.quiet[:, order], measured=clean.measured[:, :, order])
    findings = found(swapped)
    assert [findings[name].verdict for name in "abc"] == ["swapped", "swapped", "good"]
    assert "speaks as b should" in findings["a"].words and findings["a"].is_refused


@pytest.mark.parametrize(("likeness", "verdict"), [(0.8, "swapped"), (0.99, "good")])
def test_a_swap_takes_two_also_where_one_of_them_resembles_what_it_should_say(
    likeness: float, verdict: str
) -> None:
    """The advice was to leave out the one that was named: the other one's signal was fitted as its own."""
    rng = np.random.default_rng(5)
    a, other = np.linalg.qr(rng.standard_normal((600, 2)))[0].T
    b = likeness * a + np.sqrt(1 - likeness**2) * other
    noise = 1e-3 * rng.standard_normal((2, 300, 3))
    predicted = np.stack([a, b, rng.standard_normal(600)], axis=1).reshape(2, 300, 3)
    measured = predicted[:, :, [1, 0, 2]] + noise
    if verdict == "good":  # the wire of one is on both
        measured[:, :, 1], measured[:, :, 0] = predicted[:, :, 1], rng.standard_normal((2, 300))
        measured[:, :, 0] = 0.1 * measured[:, :, 0] / 10 + predicted[:, :, 1] * 0.5
    quiet = 1e-3 * rng.standard_normal((400, 3))
    channels = [CheckedChannel(name, "1", 1e-3) for name in "abc"]
    found = check_channels(channels, Pushes(quiet, np.zeros((2, 3)), measured, predicted))
    assert [f.verdict for f in found][1] == verdict


def test_noise_above_the_described_one_is_told_and_a_channel_that_nothing_moves_is_not_judged() -> None:
    clean = pushes()
    noise = np.random.default_rng(2).standard_normal
    loud = replace(clean, quiet=clean.quiet + 5 * SIGMA * noise(clean.quiet.shape) * [1, 0, 0])
    assert found(loud)["a"].verdict == "noisy"
    still = replace(clean, predicted=1e-3 * clean.predicted, measured=SIGMA * noise(clean.measured.shape))
    assert {f.verdict for f in found(still).values()} == {"not moved"}
    assert not any(f.is_refused for f in found(still).values())


def test_what_shakes_a_held_arm_is_no_noise_of_a_sensor() -> None:
    """Encoders at 1 kHz shook an arm: sound accelerometers were noisy, and dead where little moved them."""
    noise = np.random.default_rng(3).standard_normal
    clean, shaken = pushes(), 10 * SIGMA
    shaking = replace(
        clean,
        quiet=clean.quiet + shaken * noise(clean.quiet.shape),
        measured=clean.measured + shaken * noise(clean.measured.shape),
    )
    told = tuple(replace(channel, shaken=shaken) for channel in CHANNELS)
    assert {f.verdict for f in check_channels(told, shaking)} <= {"good", "not moved"}
    assert all(f.described == pytest.approx(np.hypot(SIGMA, shaken)) for f in check_channels(told, shaking))
    assert "noisy" in {f.verdict for f in check_channels(CHANNELS, shaking)}


@pytest.mark.parametrize(("share", "verdict"), [(1.0, "good"), (0.0, "dead"), (-1.0, "flipped")])
def test_an_answer_of_a_few_sigmas_is_judged(share: float, verdict: str) -> None:
    clean = pushes()
    weak = 3.3 * SIGMA / np.sqrt(np.mean(clean.predicted[:, :, 0] ** 2))
    noise = clean.measured - clean.predicted
    shares = weak * np.array([share, 1.0, 1.0])  # that the others answer tells that the arm does
    faint = replace(clean, predicted=weak * clean.predicted, measured=noise + shares * clean.predicted)
    assert found(faint)["a"].verdict == verdict


def test_the_noise_floor_does_not_see_slow_motion() -> None:
    rng, t = np.random.default_rng(1), np.arange(4000) / 200.0
    y = 0.02 * rng.standard_normal(t.size)
    assert noise_floor(y + np.sin(2 * np.pi * 0.5 * t)) == pytest.approx(0.02, rel=0.05)  # known to 2 %
