"""How long a sensor carries the estimate alone: until the next sample is late, 0.1 s of shipped cameras."""

import numpy as np
import pytest

from flexarm_estimator.judging.sensor_record import last_hope, time_out
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

CONFIG, TICK = EstimatorConfig(), 0.005


def spec(rate: float, latency: float = 0.06) -> SensorSpec:
    return SensorSpec("eye", "camera", "arm.tip", ("tx",), np.ones(1), rate_hz=rate, latency=latency)


def test_a_camera_alone_is_no_hope_where_all_had_fallen_silent_with_its_last_frame() -> None:
    """Told at the first tick after; a whole ``time_out`` beyond its latency was 0.105 s."""
    ticks = np.arange(0.0, 0.2, TICK)
    assert ticks[ticks > last_hope(spec(30.0), CONFIG)][0] == pytest.approx(0.1)


@pytest.mark.parametrize("rate", [10.0, 30.0, 60.0])
def test_a_camera_alone_carries_the_estimate_from_frame_to_frame(rate: float) -> None:
    """The next frame is heard a tick after it is due, at most."""
    assert last_hope(spec(rate), CONFIG) >= 0.06 + 1.0 / rate + TICK - 1e-12


@pytest.mark.parametrize("rate", [0.0, 200.0])
def test_a_sensor_of_the_loop_may_be_silent_for_the_time_out(rate: float) -> None:
    fast = spec(rate, 0.0)
    assert last_hope(fast, CONFIG) == time_out(fast, CONFIG) == CONFIG.time_out
