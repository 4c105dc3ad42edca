"""What is called known of a frequency, and that alarms do not go by it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from flexarm_estimator.drift.conversions import drift_from_msg, drift_to_msg
from flexarm_estimator.drift.judgement import Alarms, Healthy, ModeNow
from flexarm_estimator.drift.proposal import denial, suspicion
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.drift.undrifted import undrifted


def mode(change: float, sigma: float, is_known: bool = True) -> ModeNow:
    return ModeNow(
        "mode_1", 5.0, 5.0 * (1 + change), 5 * sigma, 0.01, 0.01, 0.001, is_known, True, change, sigma
    )


@pytest.mark.parametrize(
    ("sigma", "is_known", "is_certain"), [(0.029, True, True), (0.035, True, False), (0.02, False, False)]
)
def test_a_frequency_no_surer_than_the_drift_that_is_told_is_not_called_known(
    sigma: float, is_known: bool, is_certain: bool
) -> None:
    assert mode(-0.02, sigma, is_known).is_certain is is_certain


@pytest.mark.parametrize(
    ("drift", "sigma", "text"),
    [
        (-0.02, 0.004, "as described"),
        (0.0, 0.014, "as described"),
        (-0.0531, 0.0142, "reads -5.3 +- 1.4 %, not sure enough to tell"),  # no five sigma: no alarm
        (-0.02, 0.008, "reads -2.0 +- 0.8 %, not sure enough to tell"),
        (-0.02, 0.035, "reads -2.0 +- 3.5 %, not sure enough to tell"),
    ],
)
def test_a_mode_is_as_described_only_where_it_cannot_be_off_by_a_drift(
    drift: float, sigma: float, text: str
) -> None:
    """One of -5.3 +- 1.4 % raised no alarm, and was called as described to the end."""
    assert undrifted(mode(drift, sigma), DriftConfig()) == text


def test_a_mode_that_is_out_of_reach_or_not_judged_is_not_called_as_described() -> None:
    config, learning = DriftConfig(), DriftConfig(learning=8.0)
    assert undrifted(mode(0.0, 0.004, is_known=False), config) == "has not moved enough to tell"
    assert "out of reach" in undrifted(replace(mode(0.0, 0.004), is_settled=False), config)
    assert "not judged" in undrifted(mode(-0.31, 0.004), learning)
    learned = replace(mode(-0.31, 0.002), healthy=Healthy(-0.3, 0.002, 0.01, 0.001))
    assert undrifted(learned, learning) == "as at the start"


def test_diagnostics_say_of_every_mode_what_the_watch_says_of_it() -> None:
    def said_of(told: ModeNow) -> str:
        """Return a text that only this mode has."""
        return f"of {told.name}"

    watch: Any = SimpleNamespace(modes=(mode(0.0, 0.1),), alarms={}, said_of=said_of, said_of_sensors="")
    (told,) = drift_from_msg(drift_to_msg(watch, "", 10**9))
    assert (told.text, told.has_drifted) == ("of mode_1", False)


def test_a_change_of_many_sigmas_is_an_alarm_however_large_they_are() -> None:
    unsure, alarms = mode(-0.2, 0.035), Alarms(DriftConfig())
    alarms.look([unsure], 10.0)
    alarms.look([unsure], 11.1)
    assert not unsure.is_certain
    assert "(-20.0 %)" in alarms.told["mode_1"]


@pytest.mark.parametrize(("zeta", "is_undamped"), [(-0.004, True), (-0.0001, True), (0.002, False)])
def test_a_mode_that_reads_without_damping_puts_the_sensors_in_doubt(zeta: float, is_undamped: bool) -> None:
    """A gauge that says 0.85 times the strain read so, and the description was to be refreshed."""
    read, alarms = replace(mode(0.0, 0.005), zeta=zeta), Alarms(DriftConfig(damping_change=0.5))
    alarms.look([read], 10.0)
    alarms.look([read], 11.1)
    assert alarms.told and alarms.undamped == (("mode_1",) if is_undamped else ())


def test_the_proposal_of_a_mode_without_damping_is_to_look_at_the_sensors() -> None:
    said = suspicion({}, ("mode_1",))
    assert "not the arm" in said and denial(("mode_1",)) in said and not denial(())
