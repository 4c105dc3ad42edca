"""The drift watch and sensors that are silent, switched off or wrong: none of it is taken for the arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import DT, SENSORS, Record, StripKinematics, simulate, strip_model

from flexarm_estimator.drift.attendance import STEADY, STUTTER, Attendance
from flexarm_estimator.drift.drift_watch import DriftWatch
from flexarm_estimator.drift.opinion import Opinion
from flexarm_estimator.drift.sensors_in_use import SensorsInUse
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.settings import EstimatorConfig

QUIET = EstimatorConfig(frequency_error=0.005, modal_force=0.01)
GAUGE = "root_strain"
STEADY_PERIODS, STUTTER_PERIODS = round(STEADY / DT), round(STUTTER / DT)


def watch(config: DriftConfig | None = None) -> DriftWatch:
    return DriftWatch(strip_model(), StripKinematics(), SENSORS, (QUIET, config or DriftConfig()), DT)


def record_of(scale: float, periods: int = 1200, seed: int = 1) -> Record:
    model = strip_model(frequency_scale=scale)
    return simulate(periods, np.random.default_rng(seed), model=model, config=QUIET)


def feed(
    watch: DriftWatch, record: Record, silent: tuple[int, int] = (0, 0), factor: float = 1.0
) -> list[str]:
    """Feed a record without the gauge in some of its periods; return all that is said of the sensors."""
    said = [""]
    for k, samples in enumerate(record.samples):
        told = {sample.sensor: sample.y for sample in samples}
        if silent[0] <= k < silent[1]:
            del told[GAUGE]
        elif GAUGE in told:
            told[GAUGE] = factor * told[GAUGE]
        watch.step(k, told, record.tau[k])
        if watch.said_of_sensors != said[-1]:
            said.append(watch.said_of_sensors)
    return said


def test_what_is_known_is_forgotten_when_nobody_speaks() -> None:
    """60 s are twelve memories: sigma is what it was times the root of e^12, 400."""
    seen, record = watch(), record_of(1.0)
    feed(seen, record)
    assert seen.modes[0].is_certain
    for k in range(len(record.t), len(record.t) + round(60.0 / DT)):
        seen.step(k, {}, record.tau[0])
    assert not any(mode.is_known for mode in seen.modes)


def test_what_is_known_is_forgotten_over_a_gap_in_all_messages() -> None:
    seen, record = watch(), record_of(1.0)
    feed(seen, record)
    before = seen.modes[0].change_sigma
    for k in range(len(record.t) + round(60.0 / DT), len(record.t) + round(61.5 / DT)):
        seen.step(k, {spec.name: np.zeros(len(spec.channels)) for spec in SENSORS}, 0 * record.tau[0])
    assert before < 0.005 and not seen.modes[0].is_known


@pytest.mark.parametrize("scale", [0.95, 1.0])
def test_the_watch_goes_on_without_a_sensor_that_is_silent_and_takes_it_up_again(scale: float) -> None:
    """It stood still for good, and went on to say that it knew."""
    seen = watch()
    said = feed(seen, record_of(scale, 1600), silent=(300, 1200))
    assert said == ["", f"goes on without {GAUGE} (silent)", ""]
    mode = seen.modes[0]
    assert mode.is_certain and mode.change == pytest.approx(scale - 1.0, abs=0.005)
    assert bool(seen.alarms) == (scale != 1.0)


def test_a_sensor_that_never_spoke_is_left_out() -> None:
    seen = watch()
    feed(seen, record_of(0.95), silent=(0, 1200))
    assert GAUGE in seen.said_of_sensors
    assert seen.modes[0].is_certain and seen.modes[0].change == pytest.approx(-0.05, abs=0.005)


def test_a_sensor_that_the_estimator_does_not_use_tells_the_watch_nothing() -> None:
    """A gauge that says 0.6 times the strain read as a mode that runs elsewhere."""
    misled, told = watch(), watch()
    for each in (misled, told):
        feed(each, record_of(1.0, 400), factor=0.6)
    assert abs(misled.modes[0].change) > 5 * misled.modes[0].change_sigma
    told.heed(Opinion(unused={GAUGE: "switched off"}))
    feed(told, record_of(1.0, 1600, seed=2), factor=0.6)
    assert told.said_of_sensors == f"goes on without {GAUGE} (switched off)" and not told.alarms
    assert told.modes[0].is_certain and abs(told.modes[0].change) < 0.005


def test_without_any_sensor_that_it_may_use_the_watch_tells_nothing() -> None:
    seen = watch()
    seen.heed(Opinion(unused={spec.name: "at fault" for spec in SENSORS}))
    feed(seen, record_of(0.95, 600))
    assert seen.said_of_sensors.startswith("tells nothing without") and not seen.modes


def test_while_a_sensor_is_doubted_the_proposal_is_to_look_at_it() -> None:
    seen = watch()
    feed(seen, record_of(0.95))
    assert seen.alarms and "stiffness" in seen.proposal
    seen.heed(Opinion(doubted={GAUGE: "noise is 3 times what it should be"}))
    assert f"look first at {GAUGE}: noise is 3 times" in seen.proposal and "stiffness" not in seen.proposal
    assert seen.said_of_sensors == f"in doubt: {GAUGE} (noise is 3 times what it should be)"


@pytest.mark.parametrize("seed", range(1, 5))
def test_a_short_standstill_of_the_machine_is_no_change_of_the_arm(seed: int) -> None:
    """0.08 s of torques that nobody told, every 1.6 s: what followed from a wrong one was learned from."""
    seen, record = watch(), record_of(1.0, 1600, seed)
    for k, samples in enumerate(record.samples):
        if k < 400 or k % 320 > 16:
            seen.step(k, {sample.sensor: sample.y for sample in samples}, record.tau[k])
    mode = seen.modes[0]
    assert mode.is_certain and abs(mode.change) < 0.002


def test_with_other_sensors_a_healthy_arm_is_learned_anew() -> None:
    """What the model leaves out moves the reading of every sensor otherwise."""
    seen = watch(DriftConfig(learning=2.0))
    record = record_of(1.0, 1600)
    feed(seen, replace(record, samples=record.samples[:800]))
    assert seen.modes[0].healthy is not None
    for k in range(800, 1600):
        told = {sample.sensor: sample.y for sample in record.samples[k] if sample.sensor != GAUGE}
        seen.step(k, told, record.tau[k])
        if k == 1100:
            assert seen.modes[0].healthy is None
    assert seen.modes[0].healthy is not None


def test_who_is_silent_while_others_speak_is_noted_soon_and_is_back_when_he_speaks_steadily() -> None:
    seen = Attendance(("one", "other"), DT)
    assert [seen.note(("one",)) for _ in range(STUTTER_PERIODS + 2)] == [False] * STUTTER_PERIODS + [
        True,
        False,
    ]
    assert seen.silent == {"other"}
    for k in range(STEADY_PERIODS):
        assert not seen.note(("one", "other") if k % 3 else ("one",))
    seen.note(("one", "other"))
    seen.note(("one", "other"))
    assert not seen.silent
    for _ in range(STEADY_PERIODS):
        assert not seen.note(())  # nobody speaks: that is no fault of one of them


def test_channels_that_are_switched_off_are_left_out_of_the_samples() -> None:
    wide = replace(SENSORS[2], channels=("x", "y", "z"), sigma=np.full(3, 0.03))
    used = SensorsInUse((*SENSORS[:2], wide), ("encoder", GAUGE, wide.name), DT)
    used.heed(Opinion(channels={wide.name: ("x", "z"), GAUGE: ("no such channel",)}))
    fit = used.read({wide.name: np.array([np.nan, 2.0, 3.0]), GAUGE: np.zeros(1), "encoder": np.zeros(1)})
    assert fit[wide.name].tolist() == [2.0] and fit[GAUGE].size == 1
    assert used.has_changed and used.is_misled and used.specs[2].channels == ("y",)
    assert used.said == f"goes on without {wide.name} (x, z switched off in the estimator)"
