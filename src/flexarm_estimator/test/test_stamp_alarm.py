"""What is said of a camera's stamps, once for every change, and when that puts it out of use."""

import math

from flexarm_estimator.watches.latency_fit import Latency
from flexarm_estimator.watches.stamp_alarm import StampAlarm


def told(*steps):
    """Return reason, fault and since of all findings, for (found [s], in use [s], spare) after each other."""
    alarm = StampAlarm("camera")
    return [
        [(f.reason[:20], f.is_fault, f.since) for f in alarm.tell(Latency(found, 1e-4), used, spare)]
        for found, used, spare in steps
    ]


def test_a_small_drift_or_an_unsure_one_is_not_told():
    assert StampAlarm("camera").tell(Latency(0.004, 1e-4), 0.0, True) == []
    assert StampAlarm("camera").tell(Latency(0.006, 2.1e-3), 0.0, True) == []


def test_late_stamps_put_a_spare_camera_out_of_use_and_its_frames_out_of_the_past_once():
    steps = told((0.01, 0.0, True), (0.0105, 0.0, True), (0.015, 0.0, True), (0.0, 0.0, True))
    assert steps == [
        [("stamps are 10.0 ms l", True, -math.inf)],
        [],
        [("stamps are 15.0 ms l", True, math.inf)],
        [("", True, math.inf)],
    ]


def test_early_stamps_and_a_camera_that_is_not_spare_are_only_told():
    assert told((-0.01, 0.0, True)) == [[("stamps are 10.0 ms e", False, math.inf)]]
    assert told((0.05, 0.06, True)) == [[("stamps are 50.0 ms l", False, math.inf)]]
    assert told((0.01, 0.0, False)) == [[("stamps are 10.0 ms l", False, math.inf)]]


def test_a_camera_that_is_needed_again_is_readmitted_with_a_remark():
    alarm = StampAlarm("camera")
    assert alarm.readmit(0.0) == []
    alarm.tell(Latency(0.01, 1e-4), 0.0, True)
    back, remark = alarm.readmit(0.0)
    assert (back.reason, back.is_fault) == ("", True)
    assert remark.reason.startswith("stamps are 10.0 ms late") and not remark.is_fault
    assert not alarm.is_out
