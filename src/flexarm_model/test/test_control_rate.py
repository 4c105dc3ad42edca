"""A control rate that cannot follow the slowest mode is refused; samples per period are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm, tree

from flexarm_model.served.control_rate import describe_rate, refuse_slow_rate, samples_per_period
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError

OMEGA = 2 * np.pi * np.array([5.0, 20.0, 100.0])


def test_samples_are_counted_within_a_period_of_each_mode() -> None:
    assert samples_per_period(200.0, OMEGA) == pytest.approx([40.0, 10.0, 2.0])


def test_the_sentence_names_the_slowest_and_the_fastest_mode() -> None:
    (text,) = describe_rate(200.0, OMEGA)
    assert text.startswith(
        "rate 200 Hz: 40 samples per period of mode 1, 2 samples per period of mode 3; five"
    )
    (alone,) = describe_rate(200.0, OMEGA[:1])
    assert alone.startswith("rate 200 Hz: 40 samples per period of mode 1; five to ten wanted")
    assert describe_rate(200.0, OMEGA[:0]) == ()


@pytest.mark.parametrize(("rate_hz", "fits"), [(200.0, True), (10.6, True), (10.3, False), (5.0, False)])
def test_a_rate_below_two_samples_of_the_slowest_mode_is_refused(rate_hz: float, fits: bool) -> None:
    config, omega = replace(arm("single_link"), rate_hz=rate_hz), linearize(tree("single_link")).omega
    if fits:  # 5.230 Hz, seed 002
        refuse_slow_rate(config, omega)
        return
    told = (
        rf"single_link: served\.rate: {rate_hz:g} Hz: .* of mode 1 at 5\.23 Hz; expected at least 10\.46 Hz"
    )
    with pytest.raises(ConfigError, match=told):
        refuse_slow_rate(config, omega)


def test_an_arm_without_modes_takes_any_rate() -> None:
    refuse_slow_rate(replace(arm("single_link"), rate_hz=0.1), np.zeros(0))
