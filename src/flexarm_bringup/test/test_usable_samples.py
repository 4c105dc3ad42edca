"""What a likelihood hears of a bag is what the estimator would hear of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from flexarm_bringup.consistency import first_hearing
from flexarm_bringup.consistency.bag_epochs import read_epochs
from flexarm_bringup.consistency.late_stamps import LateStamps, delays_in_use
from flexarm_bringup.consistency.recording import open_recording
from flexarm_bringup.consistency.usable_samples import own_words, usable_samples
from flexarm_estimator.measurement import Measurement
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

GOLDEN = Path(__file__).parents[3] / "tests" / "golden"
SPECS = load_config(find_manipulator("single_link")).sensors
GAUGE = next(spec for spec in SPECS if spec.kind == "strain_gauge")


def said(values, R=None):
    return [Measurement(GAUGE.name, 0.01 * k, np.array([y]), R) for k, y in enumerate(values)]


def test_samples_that_cannot_be_are_left_out_and_counted_by_reason():
    """Three of 480 beyond the range made a NIS of 0.11 one of 6817."""
    twice = [*said([1e-5, 2 * GAUGE.high, np.nan, 3 * GAUGE.high, 2e-5]), *said([0.0])]
    usable = usable_samples(sorted(twice, key=lambda sample: sample.t), SPECS)
    assert [sample.y[0] for sample in usable.samples] == [1e-5, 2e-5]
    (line,) = usable.describe()
    assert line.startswith(f"left out, as the estimator does, of {GAUGE.name}: ")
    for reason in ("1 samples (duplicate stamp)", "1 samples (not finite)", "2 samples (outside ["):
        assert reason in line
    assert usable_samples(said([0.0]), SPECS).describe() == []


@pytest.mark.parametrize(
    ("factor", "believed"),
    [(9.0, 9.0), (1e-8, 0.01), (np.nan, None), (np.inf, None), (-1.0, None), (0.0, None)],
)
def test_a_covariance_of_a_message_counts_as_far_as_it_is_believed(factor, believed):
    """One of NaN ended in "has a gap, say"; gauges that claimed 1e-4 of their sigma were believed."""
    variance = float(GAUGE.sigma[0]) ** 2
    usable = usable_samples(said([0.0, 1e-6], np.array([[factor * variance]])), SPECS)
    told = [sample.R for sample in usable.samples]
    if believed is None:
        assert told == [None, None] and usable.own == ()
    else:
        np.testing.assert_allclose(told, believed * variance, rtol=1e-12)
        assert usable.own == (GAUGE.name,)


def test_a_sample_near_the_end_of_its_range_is_less_certain():
    (sample,) = usable_samples(said([0.9999 * GAUGE.high]), SPECS).samples
    assert sample.R is not None and sample.R[0, 0] > 100 * GAUGE.sigma[0] ** 2


def test_sensors_that_tell_their_own_covariance_are_named_once():
    assert own_words([]) == []
    (line,) = own_words(["camera", "root_strain"])
    assert line.startswith("camera, root_strain: their messages bring a covariance of their own")


def test_frames_count_at_the_instants_that_were_found():
    """A camera 30 ms late had a sigma proposed that was six times too large, with every check kept."""
    recording = open_recording(GOLDEN / "single_link" / "bag")
    as_stamped, moved = (
        [epoch.t for epoch in read_epochs(recording, delays).epochs if "camera" in epoch.samples]
        for delays in ({}, {"camera": 0.0123})
    )
    np.testing.assert_allclose(np.array(as_stamped) - moved, 0.0123, atol=1e-9)


def test_a_camera_that_stamps_later_than_is_undone_is_told():
    late = LateStamps("camera", 0.0, 0.030, 0.0004)
    assert not late.check({}).passed
    assert late.check({}).found == "30.0 ms late (one sigma 0.4 ms)"
    assert delays_in_use([late], is_calibrated=False) == {}
    assert late.check(delays_in_use([late], is_calibrated=True)).passed
    assert replace(late, configured=0.0304).check({}).passed
    assert late.describe() == "frames of camera count 30.0 ms before their stamp, as calibrated"


def test_lateness_and_faults_are_what_the_estimator_finds_by_itself(monkeypatch):
    """Who was put out of use counted without a word."""
    figures = {
        "camera": {
            "stamp delay in use [s]": 0.01,
            "stamp delay found [s]": 0.03,
            "its one sigma [s]": 0.0004,
        },
        GAUGE.name: {},
    }
    statuses = ["ok", "faulty", "faulty", "ok"]
    exchange = SimpleNamespace(estimator=SimpleNamespace(figures=lambda: figures), estimate=None)

    def play(_):
        """Give what is sent in four steps."""
        for k, status in enumerate(statuses):
            reports = [
                SimpleNamespace(name=GAUGE.name, status=status, reason="frozen"),
                SimpleNamespace(name="camera", status="ok", reason=""),
            ]
            exchange.estimate = SimpleNamespace(t=7.0 + k, sensors=reports)
            yield None, SimpleNamespace(topic="modal_state")
            yield None, SimpleNamespace(topic="end_effector")

    monkeypatch.setattr(first_hearing, "EstimatorExchange", lambda *_: exchange)
    monkeypatch.setattr(first_hearing, "Player", lambda *_: SimpleNamespace(play=play))
    recording = SimpleNamespace(
        config=SimpleNamespace(sensors=SPECS), settings=None, epoch_ns=0, lockstep=True,
        bag=SimpleNamespace(records=()),
    )  # fmt: skip
    first = first_hearing.hear(recording)
    assert first.late == [LateStamps("camera", 0.0, 0.03, 0.0004)]
    (line,) = first.describe()
    assert f"{GAUGE.name} counts throughout" in line
    assert "out of use in 50 % of the bag, from 1.00 to 2.00 s (frozen)" in line
