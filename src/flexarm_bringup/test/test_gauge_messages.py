"""A bridge's output on the topic: the rig says V/V; estimator, guard and plots make strain of it again."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.bag_plots.estimate_panels import draw_strain  # noqa: E402
from flexarm_bringup.page.figures import drawing  # noqa: E402
from flexarm_bringup.sim.conversions import strain_msg  # noqa: E402
from flexarm_bringup.sim.sample import Sample  # noqa: E402
from flexarm_controller.guard_settings import gauges_of  # noqa: E402
from flexarm_estimator.messages.sensor_messages import SensorReader  # noqa: E402
from flexarm_model.manipulator.description import ManipulatorConfig  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402

OUTPUTS = (1.0, 2.05 / 4, -2.05 / 2, 130.0)


def described(output: float) -> ManipulatorConfig:
    """Return the single link with a gauge whose messages hold so much per strain."""
    config = load_config(find_manipulator("single_link"))
    gauges = [replace(s, output=output) if s.kind == "strain_gauge" else s for s in config.sensors]
    return replace(config, sensors=tuple(gauges))


@pytest.mark.parametrize("output", OUTPUTS)
@pytest.mark.parametrize("strain", [3e-4, -2e-6, 0.0])
def test_what_the_rig_publishes_is_read_as_the_strain_that_it_felt(output: float, strain: float) -> None:
    config = described(output)
    spec = next(spec for spec in config.sensors if spec.kind == "strain_gauge")
    msg = strain_msg({spec.name: spec}, [Sample(spec.name, spec.kind, 0, np.array([strain]))], 0).msg
    assert list(msg.strain) == pytest.approx([output * strain], rel=1e-15)
    assert list(msg.standard_deviation) == pytest.approx([abs(output) * spec.sigma[0]], rel=1e-15)
    (sample,) = SensorReader(config).read("strain", msg, 0.0).samples
    assert sample.y == pytest.approx([strain], rel=1e-15)
    assert sample.R is None  # the noise is the one of the description
    msg.standard_deviation = [3 * abs(output) * spec.sigma[0]]
    (sample,) = SensorReader(config).read("strain", msg, 0.0).samples
    assert pytest.approx(9 * spec.sigma[0] ** 2 * np.eye(1), rel=1e-14) == sample.R
    gauges = gauges_of(config)
    gauges.hear(msg.names, msg.strain)
    assert gauges.read() == pytest.approx((strain,), rel=1e-15)


def test_a_plot_shows_strain_whatever_the_messages_hold() -> None:
    told, drawn = 2e-4, []
    for output in OUTPUTS:
        config = described(output)
        name = next(spec.name for spec in config.sensors if spec.kind == "strain_gauge")
        series = SimpleNamespace(
            config=config,
            messages=lambda topic, name=name: [SimpleNamespace(names=[name])],
            times=lambda topic: np.arange(2.0),
            column=lambda topic, value, output=output: np.full((2, 1), output * told),
            has=lambda topic: False,
        )
        with drawing() as plot:
            draw_strain(plot, series)  # type: ignore[arg-type]
            drawn.append(plot.axes[0].lines[0].get_ydata()[0])
    assert drawn == pytest.approx([1e6 * told] * len(OUTPUTS), rel=1e-12)
