import numpy as np
import pytest
from planar_strip import CAMERA, SENSORS

from flexarm_estimator.judging.checks import SampleChecks, Window
from flexarm_estimator.judging.health import Health
from flexarm_estimator.judging.reception import Reception
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

WINDOW = Window(oldest=1.0, newest=1.3)


def refusal(sensor="encoder", t=1.1, y=(0.1,)):
    return SampleChecks(SENSORS).refuse(Measurement(sensor, t, np.array(y, dtype=float)), WINDOW)


def admitted(sample):
    """Return a sample as it was taken, and what was counted."""
    health = Health(SENSORS, {}, EstimatorConfig())
    (taken,) = Reception(SENSORS, EstimatorConfig(), health).admit([sample], 1.1, 1.0).all
    return taken, health.refusals.counts


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, ""),
        ({"sensor": "ghost"}, "unknown sensor"),
        ({"y": ()}, "needs 1 numbers"),
        ({"y": (1.0, 2.0)}, "needs 1 numbers"),
        ({"y": (np.nan,)}, "not finite"),
        ({"y": (np.inf,)}, "not finite"),
        ({"y": (101.0,)}, "outside"),
        ({"sensor": "camera", "y": (640.0, 0, 0, 0, 0, 0)}, "outside"),  # millimetres
        ({"sensor": "camera", "y": (0.6, 0, 0, 0, 0, np.nan)}, "not finite"),
        ({"t": np.nan}, "stamp is not finite"),
        ({"t": 1.31}, "stamp is in the future"),
        ({"t": 1.0}, "older than the history"),
        ({"t": 0.2}, "older than the history"),
    ],
)
def test_a_sample_is_refused_with_its_reason(changes, reason):
    found = refusal(**changes)
    assert found.startswith(reason)
    assert bool(found) == bool(reason)


@pytest.mark.parametrize(
    ("y", "given"),
    [
        ([0.1], "not a list"),
        (0.1, "not a float"),
        (np.array([0.1], dtype=np.float32), "not an array of float32"),
        (np.array([1]), "not an array of int64"),
        (np.array([[0.1]]), r"not shape (1, 1)"),
        (np.array([0.1, 0.2]), r"not shape (2,)"),
    ],
)
def test_a_value_that_is_no_array_of_floats_is_told_as_what_it_is(y, given):
    """One number in a list was refused with "needs 1 numbers"."""
    found = SampleChecks(SENSORS).refuse(Measurement("encoder", 1.1, y), WINDOW)
    assert found == f"needs 1 numbers in an array of float64, {given}"


def test_a_stamp_counts_once_whatever_the_order():
    checks = SampleChecks(SENSORS)
    times = [1.10, 1.05, 1.20, 1.05 + 5e-7, 1.10, 1.20]
    reasons = [checks.refuse(Measurement("encoder", t, np.zeros(1)), WINDOW) for t in times]
    assert reasons == ["", "", ""] + ["duplicate stamp"] * 3


def test_refused_samples_do_not_block_their_stamp():
    checks = SampleChecks(SENSORS)
    assert checks.refuse(Measurement("encoder", 1.1, np.array([np.nan])), WINDOW)
    assert not checks.refuse(Measurement("encoder", 1.1, np.zeros(1)), WINDOW)


def test_an_own_covariance_is_floored_and_one_that_says_nothing_is_dropped():
    checks = SampleChecks(SENSORS)
    sigma2 = CAMERA.sigma**2

    def own(R):
        return checks.own_covariance(Measurement("camera", 1.1, np.zeros(6), R))

    np.testing.assert_allclose(own(np.diag(4 * sigma2)), np.diag(4 * sigma2))
    np.testing.assert_allclose(own(np.diag(1e-9 * sigma2)), np.diag(0.01 * sigma2))
    indefinite = np.diag(sigma2)
    indefinite[0, 1] = indefinite[1, 0] = 2 * sigma2[0]
    bad = (
        None,
        np.zeros((6, 6)),
        -np.eye(6),
        np.full((6, 6), np.nan),
        np.eye(5),
        np.eye(6, dtype=int),
        indefinite,
    )
    assert all(own(R) is None for R in bad)


@pytest.mark.parametrize(
    ("R", "given"),
    [
        (1e-2, "a float"),
        ([[1e-2]], "a list"),
        (np.array([1e-2]), "shape (1,)"),
        (np.array(1e-2), "shape ()"),
        (np.eye(2), "shape (2, 2)"),
        (np.array([[1]]), "an array of int64"),
    ],
)
def test_a_covariance_of_another_shape_is_counted_and_its_sample_used_with_that_of_the_description(R, given):
    """A variance without brackets was taken for none at all, and nothing said so."""
    taken, counts = admitted(Measurement("encoder", 1.1, np.zeros(1), R))
    assert taken.R is None
    reason = f"covariance needs 1 x 1 numbers in an array of float64, not {given}"
    assert counts == {"encoder": {reason: 1}}


@pytest.mark.parametrize(
    ("R", "reason"),
    [
        (np.zeros((6, 6)), ""),  # of drivers that know none
        (np.diag(CAMERA.sigma**2), ""),
        (-np.eye(6), "covariance has a variance that is not positive"),
        (np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), "covariance has a variance that is not positive"),
        (np.full((6, 6), np.nan), "covariance is not finite"),
        (np.diag([1.0, 1.0, 1.0, 1.0, 1.0, np.inf]), "covariance is not finite"),
        (np.eye(6) + 1.0 - np.eye(6) * 1.5, "covariance is not positive definite"),
    ],
)
def test_a_covariance_that_is_none_is_counted_and_its_sample_used_with_that_of_the_description(R, reason):
    taken, counts = admitted(Measurement("camera", 1.1, np.zeros(6), R))
    assert (taken.R is None) == (bool(reason) or not R.any())
    assert counts == ({"camera": {reason: 1}} if reason else {})


@pytest.mark.parametrize("size", [1e3, 1e154, 1e308])
def test_a_covariance_that_says_next_to_nothing_is_cut_so_that_its_square_is_finite(size):
    R = SampleChecks(SENSORS).own_covariance(Measurement("camera", 1.1, np.zeros(6), size * np.eye(6)))
    assert R is not None
    assert (R.diagonal() <= 1e12 * CAMERA.sigma**2).all()
    assert np.linalg.eigvalsh(R).min() > 0.0


def test_a_sample_at_the_end_of_its_range_is_noisy_as_the_truth_lies_beyond():
    checks = SampleChecks(SENSORS)
    gauge = next(spec for spec in SENSORS if spec.name == "root_strain")
    window = Window(0.0, 10.0)
    for k, (value, is_clipped) in enumerate(((0.5, False), (0.98, False), (0.995, True), (-1.0, True))):
        sample = Measurement("root_strain", 1.0 + k, np.array([value * gauge.high]))
        assert checks.refuse(sample, window) == ""
        R = checks.noise(sample)
        assert (R is not None) == is_clipped
        if R is not None:
            assert np.sqrt(R[0, 0]) == pytest.approx(0.3 * gauge.high, rel=1e-6)  # 30 % of half the range


def test_the_stamp_of_a_scan_counts_once_however_many_scans_have_become_too_old():
    checks, last = SampleChecks(SENSORS), 0.0
    pair = ("encoder", "root_strain")
    for k in range(1, 11):
        last, oldest = 0.1 * k, 0.1 * k - 0.25
        scan = [Measurement(sensor, last, np.zeros(1)) for sensor in pair]
        assert checks.take_scan(scan, oldest, last) is not None
    again = (Measurement("encoder", last - age, np.zeros(1)) for age in (0.0, 0.1, 0.2))
    assert [checks.refuse(sample, Window(oldest, last)) for sample in again] == ["duplicate stamp"] * 3
