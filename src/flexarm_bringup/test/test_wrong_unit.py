"""An encoder that speaks in degrees: none of it is fused, whichever encoder and whatever the noise."""

from __future__ import annotations

from functools import cache

import pytest

from flexarm_bringup.fault_drill.findings import fused_at_most, honest_while_usable, tip_within
from flexarm_bringup.fault_drill.row import Case
from flexarm_bringup.fault_drill.sample_rows import IN_DEGREES
from flexarm_bringup.fault_drill.stand import Stand

pytestmark = pytest.mark.slow
MEASURES = (tip_within(8.0), fused_at_most(0), honest_while_usable(0.99))


@cache
def stand(seed: int) -> Stand:
    """Return the stand whose axes never come near an angle that could be one in degrees."""
    return Stand("planar_3rrr", seed)


@pytest.mark.parametrize("encoder", ["encoder_1", "encoder_2", "encoder_3"])
@pytest.mark.parametrize("seed", range(1, 8))
def test_no_angle_in_degrees_is_fused(seed: int, encoder: str) -> None:
    found = Case(lambda bench: (encoder,), IN_DEGREES, MEASURES).play(stand(seed))
    assert {each.what: each.measured for each in found if not each.passed} == {}
