"""What gauges say in a period: the largest strain counts, whatever came before or after it."""

from __future__ import annotations

import math
from itertools import permutations

import pytest

from flexarm_controller.guarding.strain_gauges import GaugeChannel, StrainGauges

ROOT, BRIDGE, FREE = (
    GaugeChannel("root", limit=1e-3),
    GaugeChannel("bridge", -0.5, 2e-3),
    GaugeChannel("free"),
)
CHANNELS = (ROOT, BRIDGE, BRIDGE, FREE)
NAN, INF = math.nan, math.inf


def test_strains_are_in_the_order_of_the_limits_and_a_silent_gauge_is_not_a_number() -> None:
    gauges = StrainGauges(CHANNELS)
    assert list(map(math.isnan, gauges.read())) == [True] * 4
    gauges.hear(["bridge", "free", "bridge", "encoder"], [1e-4, 3e-4, -2e-4, 1.0])
    assert gauges.read()[1:] == (-2e-4, 4e-4, 3e-4) and math.isnan(gauges.read()[0])  # V/V over -0.5
    gauges.begin()
    gauges.hear(["root"], [1e-4])
    assert gauges.read()[0] == 1e-4 and list(map(math.isnan, gauges.read()[1:])) == [True] * 3


@pytest.mark.parametrize(
    ("said", "kept"),
    [
        ((2e-4, -5e-3, 1e-4), -5e-3),
        ((NAN, -5e-3, 1e-4), -5e-3),
        ((NAN, NAN, 1e-4), 1e-4),
        ((INF, 5e-3, NAN), INF),
        ((-INF, 5e-3, 0.0), -INF),
    ],
)
def test_whatever_the_order_the_strain_of_largest_magnitude_is_kept_until_the_period_ends(
    said: tuple[float, ...], kept: float
) -> None:
    """The last one was: a gauge faster than the motors was far beyond its limit, and nothing stopped."""
    gauges = StrainGauges([ROOT])
    for order in permutations(said):
        gauges.begin()
        for strain in order:
            gauges.hear(["root"], [strain])
        assert gauges.read() == (kept,)
        gauges.begin()
        assert math.isnan(gauges.read()[0])
        gauges.hear(["root"], [1e-5])
        assert gauges.read() == (1e-5,)  # of this period alone


def test_every_message_begins_with_the_first_channel_and_surplus_is_passed_over() -> None:
    gauges = StrainGauges(CHANNELS)
    for told in ([1e-4, 1e-4], [-3e-4, 2e-4, 9.0, 9.0]):
        gauges.hear(["bridge"] * 3, told)
    gauges.hear(["root", "bridge"], [1e-5])  # a name without a number
    gauges.hear(["root"], [2e-5, 9.0])  # a number without a name
    gauges.take("encoder", 0, 9.0)
    assert gauges.read()[:3] == (2e-5, 6e-4, -4e-4) and math.isnan(gauges.read()[3])


def test_unheard_is_what_has_a_limit_and_has_never_said_a_number() -> None:
    gauges = StrainGauges(CHANNELS)
    assert gauges.unheard == (0, 1, 2)
    gauges.hear(["root", "bridge", "encoder"], [NAN, 0.0, 1.0])
    assert gauges.unheard == (0, 2)
    gauges.begin()
    gauges.hear(["root"], [-1e-4])
    gauges.hear(["root"], [NAN])
    gauges.begin()
    assert gauges.unheard == (2,)
    gauges.hear(["bridge"] * 2, [NAN, INF])
    assert gauges.unheard == ()
