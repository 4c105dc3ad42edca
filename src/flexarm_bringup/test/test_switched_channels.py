"""Channels that are switched off by hand: the estimator is the one of an arm that does not have them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml

from flexarm_bringup.sim.rig import Rig
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.intervention import InterventionError
from flexarm_estimator.interventions.reset import Reset
from flexarm_estimator.interventions.set_noise import SetNoise
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

STEPS = 160
WHOLE = {"tip_accelerometer": "xyz", "tip_gyroscope": "xyz", "camera": ("tx", "ty", "tz", "rx", "ry", "rz")}
KEPT = {"tip_accelerometer": "y", "tip_gyroscope": "z", "camera": ("tx", "ty", "tz")}
OFF = {name: tuple(c for c in WHOLE[name] if c not in KEPT[name]) for name in WHOLE}


def arm(folder: Path, axes: dict[str, str | tuple[str, ...]]) -> ManipulatorConfig:
    """Return the single link with a unit at its tip and a camera that have these axes."""
    content = yaml.safe_load(find_manipulator("single_link").read_text(encoding="utf-8"))
    sensors = content["sensors"]
    sensors["tip_gyroscope"] = {
        "kind": "gyroscope", "node": "strip.sensor", "sigma": "2 mrad/s", "range": "2000 deg/s",
        "bias": {"sigma": "5 mrad/s", "drift": "0.05 mrad/s/sqrt(s)", "limit": "50 mrad/s"},
    }  # fmt: skip
    for name, channels in axes.items():
        sensors[name]["axes"] = list(channels)
    if "rx" not in axes["camera"]:
        sensors["camera"].pop("sigma_angle")
    path = folder / f"{len(axes['camera'])}.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return load_config(path, "geared")


class Arms:
    """The arm with and without its further channels, and what all of them said in a run."""

    def __init__(self, folder: Path) -> None:
        self.whole, self.part = arm(folder, WHOLE), arm(folder, KEPT)
        self.trees = {config.config_id: ReducedTree(config) for config in (self.whole, self.part)}
        rig = Rig(self.whole)
        self.dt, self.tau = rig.dt, 1.5 * np.sin(9.0 * rig.dt * np.arange(STEPS + 1))[:, None]
        heard = [rig.observe(), *(rig.step(tau) for tau in self.tau[1:])]
        self.samples = [
            [Measurement(s.sensor, rig.time_of(s.tick), np.array(s.y)) for s in each] for each in heard
        ]

    def estimator(self, config: ManipulatorConfig, filter_: str = "corrected") -> Estimator:
        """The linear filter knows no centripetal acceleration: x of the tip contradicts it."""
        tree = self.trees[config.config_id]
        return Estimator(linearize(tree), tree, config.sensors, EstimatorConfig(filter=filter_))

    def run(self, made: Estimator, first: int, last: int, *, narrow: bool = False) -> Estimate:
        for k in range(first, last):
            samples = [self.narrowed(s) for s in self.samples[k]] if narrow else self.samples[k]
            estimate = made.step(samples, self.tau[k], k * self.dt)
        return estimate

    @staticmethod
    def narrowed(sample: Measurement) -> Measurement:
        if sample.sensor not in WHOLE:
            return sample
        places = [list(WHOLE[sample.sensor]).index(c) for c in KEPT[sample.sensor]]
        return sample._replace(y=sample.y[places])


@pytest.fixture(scope="module")
def arms(tmp_path_factory: pytest.TempPathFactory) -> Arms:
    return Arms(tmp_path_factory.mktemp("arms"))


def do(made: Estimator, *interventions: ToggleSensor | SetNoise | Reset) -> None:
    for intervention in interventions:
        intervention.check(made)
        intervention.apply(made)


@cache
def all_off() -> tuple[ToggleSensor, ...]:
    return tuple(ToggleSensor(name, False, channels) for name, channels in OFF.items())


@pytest.mark.parametrize(
    "filter_", ["linear", "corrected", "extended", pytest.param("unscented", marks=pytest.mark.slow)]
)
def test_without_channels_it_is_the_estimator_of_an_arm_that_has_none(arms: Arms, filter_: str) -> None:
    made, plain = arms.estimator(arms.whole, filter_), arms.estimator(arms.part, filter_)
    do(made, *all_off())
    for last in range(10, STEPS, 10):
        found = arms.run(made, last - 10, last)
        expected = arms.run(plain, last - 10, last, narrow=True)
        assert found.layout == expected.layout
        np.testing.assert_allclose(found.x, expected.x, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(found.P, expected.P, rtol=1e-6, atol=1e-12)
        assert found.status == expected.status
    reports = {report.name: report for report in found.sensors}
    assert reports["tip_accelerometer"].innovation.shape == (1,)
    assert reports["tip_accelerometer"].reason == "x, z switched off"
    assert reports["camera"].status == "ok" and reports["camera"].reason == "rx, ry, rz switched off"
    assert reports["encoder"].reason == ""


def test_in_a_run_the_state_goes_on_and_so_do_the_counts(arms: Arms) -> None:
    made = arms.estimator(arms.whole)
    before = arms.run(made, 0, 80)
    kept = made.past[1][-1].belief.x[: made.past[0].layout.d.stop].copy()
    do(made, *all_off())
    np.testing.assert_allclose(made.past[1][-1].belief.x[: len(kept)], kept, rtol=0, atol=1e-12)
    name = "tip_accelerometer.y"
    assert [b for b in made.past[0].layout.biases if b.startswith("tip_acc")] == [name]
    bias, at = before.x[before.layout.b][before.layout.biases.index(name)], made.past[0].layout
    assert made.past[1][-1].belief.x[at.b][at.biases.index(name)] == pytest.approx(bias, abs=1e-12)
    after = arms.run(made, 80, 81)
    assert abs(after.theta[0] - before.theta[0] - before.theta_dot[0] * arms.dt) < 1e-3
    counts = [next(r for r in e.sensors if r.name == "tip_accelerometer").accepted for e in (before, after)]
    assert counts[1] == counts[0] + 1 and after.status == before.status == "ok"
    assert arms.run(made, 81, 120).status == "ok"
    do(made, *(ToggleSensor(name, True, channels) for name, channels in OFF.items()))
    assert [spec.channels for spec in made.specs] == [spec.channels for spec in arms.whole.sensors]
    assert all(spec.mounted is None for spec in made.specs)
    again = arms.run(made, 120, STEPS)
    assert again.status == "ok" and again.layout == before.layout
    assert all(report.reason == "" for report in again.sensors)


def test_a_broken_axis_no_longer_costs_the_others(arms: Arms) -> None:
    """NaN in one number refuses a whole sample; with the axis switched off the others are fused."""
    made, counts = arms.estimator(arms.whole), []
    for k in range(40):
        broken = [
            s._replace(y=s.y * [np.nan, 1.0, 1.0]) if s.sensor == "tip_accelerometer" else s
            for s in arms.samples[k]
        ]
        if k == 20:
            do(made, ToggleSensor("tip_accelerometer", False, ("x",)))
        found = made.step(broken, arms.tau[k], k * arms.dt)
        counts.append(next(r for r in found.sensors if r.name == "tip_accelerometer").accepted)
    assert counts[19] == 0 and counts[-1] == 20 and found.status == "ok"


def test_frames_on_their_way_are_dropped_and_what_is_off_stays_off(arms: Arms) -> None:
    made = arms.estimator(arms.whole)
    arms.run(made, 0, 50)
    before = next(r for r in made.health.reports(0.0) if r.name == "camera").accepted
    do(made, ToggleSensor("root_strain", False), ToggleSensor("camera", False, ("tz",)), Reset())
    found = arms.run(made, 50, 120)
    reports = {report.name: report for report in found.sensors}
    assert reports["root_strain"].status == "off" and reports["camera"].innovation.shape == (5,)
    assert reports["camera"].accepted > before and found.status == "ok"
    do(made, ToggleSensor("root_strain", True))
    assert arms.run(made, 120, STEPS).status == "ok"


def test_noise_that_was_set_stays_with_its_channel(arms: Arms) -> None:
    made = arms.estimator(arms.whole)
    do(made, ToggleSensor("tip_gyroscope", False, ("x",)), SetNoise("tip_gyroscope", (0.01, 0.02)))
    do(made, ToggleSensor("tip_gyroscope", False, ("y",)))
    spec = next(spec for spec in made.specs if spec.name == "tip_gyroscope")
    assert (spec.channels, spec.sigma.tolist()) == (("z",), [0.02])
    do(made, ToggleSensor("tip_gyroscope", True, ("x", "y")))
    spec = next(spec for spec in made.specs if spec.name == "tip_gyroscope")
    assert (spec.channels, spec.sigma.tolist()) == (("x", "y", "z"), [2e-3, 2e-3, 0.02])


@pytest.mark.parametrize(
    ("sensor", "channels", "words"),
    [
        ("tip_accelerometer", ("w",), "channels: no channel 'w'; allowed: x, y, z"),
        ("tip_accelerometer", ("x", "y", "z"), "channels: none would be left; allowed: no channels"),
        ("encoder", ("position",), "channels: none would be left"),
        (
            "camera",
            ("rx",),
            "would be left; expected some of tx, ty, tz; and rx, ry, rz all together or none",
        ),
        ("camera", ("tx", "ty", "tz"), "channels: rx, ry, rz would be left; expected some of tx, ty, tz"),
        ("nobody", ("x",), "name: no sensor 'nobody'"),
    ],
)
def test_channels_that_cannot_be_switched_off_are_named(
    arms: Arms, sensor: str, channels: tuple[str, ...], words: str
) -> None:
    with pytest.raises(InterventionError) as refused:
        ToggleSensor(sensor, False, channels).check(arms.estimator(arms.whole))
    assert words in str(refused.value)


def test_a_sample_of_another_length_does_not_pass_for_a_narrow_one(arms: Arms) -> None:
    made = arms.estimator(arms.whole)
    do(made, ToggleSensor("tip_accelerometer", False, ("x",)))
    made.step([Measurement("tip_accelerometer", 0.0, np.zeros(2))], arms.tau[0], 0.0)
    made.step([Measurement("tip_accelerometer", arms.dt, np.zeros(5))], arms.tau[1], arms.dt)
    assert sum(made.health.refusals.counts.get("tip_accelerometer", {}).values()) == 2


def test_a_covariance_of_another_shape_does_not_pass_for_a_narrow_one(arms: Arms) -> None:
    made = arms.estimator(arms.whole)
    m = next(len(spec.channels) for spec in made.specs if spec.name == "tip_accelerometer")
    do(made, ToggleSensor("tip_accelerometer", False, ("x",)))
    for k, size in enumerate((m, m - 1)):
        sample = Measurement("tip_accelerometer", k * arms.dt, np.zeros(m), np.eye(size))
        made.step([sample], arms.tau[k], k * arms.dt)
    (reason,) = made.health.refusals.counts["tip_accelerometer"].items()
    assert reason[1] == 1 and reason[0].startswith("covariance needs")
