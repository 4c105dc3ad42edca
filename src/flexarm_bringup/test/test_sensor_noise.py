"""Noise of the simulated sensors: what a generator of their own gives, sample by sample."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np

from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import Rig
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_bringup.sim.sensor_simulator import DRAWN_TOGETHER, SensorSimulator
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

DT = 0.005


def test_noise_drawn_together_is_the_noise_drawn_sample_by_sample() -> None:
    config = load_config(find_manipulator("single_link"))
    plant = Plant(config, DT)
    spec = next(spec for spec in config.sensors if spec.kind == "accelerometer")
    spec = replace(spec, rate_hz=0.0, latency=0.0)  # speaks in every period, at once
    rows = list(range(2, 2 + spec.sigma.size))
    sensor = SensorSimulator(spec, rows, DT, seed=7, noise=2.0)
    rng = np.random.default_rng([7, zlib.crc32(spec.name.encode())])
    outputs = np.arange(10.0)
    for tick in range(2 * DRAWN_TOGETHER + 3):
        (sample,) = sensor.sample(tick, plant, outputs)
        expected = outputs[rows] + 2.0 * spec.sigma * rng.standard_normal(spec.sigma.size)
        np.testing.assert_array_equal(sample.y, expected)
        assert (sample.sensor, sample.kind, sample.tick) == (spec.name, spec.kind, tick)


def test_sensors_that_speak_together_say_what_each_would_say_alone() -> None:
    config = load_config(find_manipulator("single_link"))
    together, alone = Rig(config), Rig(config)
    alone.set_faults({})  # from now on each speaks for itself
    for tick in range(2 * DRAWN_TOGETHER + 3):
        if tick == DRAWN_TOGETHER // 2:
            for rig in (together, alone):
                rig.set_faults({"encoder": SensorFault("bias", bias=0.1)})
        for mine, expected in zip(together.rest(), alone.rest(), strict=True):
            assert mine[:3] == expected[:3]
            np.testing.assert_array_equal(mine.y, expected.y)
