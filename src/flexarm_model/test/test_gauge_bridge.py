"""What a bridge says per strain: against the resistors of its arms, and as a key of the description."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from arms import FOLDER
from descriptions import refusal, write_arm
from hypothesis import given
from hypothesis import strategies as st

from flexarm_model.manipulator.gauge_bridge import ARMS, read_output
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import Section

ARM = FOLDER.parents[3] / "docs/two_link.yaml"
SIGNS = {"quarter": (1, 0, 0, 0), "half": (1, -1, 0, 0), "full": (1, -1, 1, -1)}  # of strain in arms 1 to 4


def by_resistors(bridge: str, change: float) -> float:
    """Return U / U_0 of four equal resistors, those that are gauges changed by k strain."""
    r1, r2, r3, r4 = (1.0 + sign * change for sign in SIGNS[bridge])
    return r1 / (r1 + r2) - r4 / (r3 + r4)


@given(st.sampled_from(sorted(ARMS)), st.floats(0.5, 200.0), st.booleans(), st.floats(-2e-5, 2e-5))
def test_the_output_is_that_of_the_resistors(bridge: str, factor: float, turned: bool, strain: float) -> None:
    factor = -factor if turned else factor
    output = read_output(Section({"gauge_factor": factor, "bridge": bridge}, "arm.yaml"))
    lost = abs(factor * strain) if bridge == "quarter" else 0.0  # twice what the quarter bridge says less
    assert output * strain == pytest.approx(by_resistors(bridge, factor * strain), rel=lost, abs=1e-15)


def test_a_quarter_bridge_of_metal_says_a_thousandth_less_at_1000_ustrain() -> None:
    """The docstring's figure."""
    output = read_output(Section({"gauge_factor": 2, "bridge": "quarter"}, "arm.yaml"))
    assert 1 - by_resistors("quarter", 2e-3) / (output * 1e-3) == pytest.approx(1e-3, rel=0.01)


def write(folder: Path, **keys: Any) -> Path:
    content = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    content["sensors"]["upper_strain"].update(keys)
    return write_arm(folder, content)


@pytest.mark.parametrize(
    ("keys", "output"),
    [
        ({}, 1.0),
        ({"gauge_factor": 2.05, "bridge": "quarter"}, 2.05 / 4),
        ({"gauge_factor": 2.05, "bridge": "half"}, 2.05 / 2),
        ({"gauge_factor": -2.05, "bridge": "full"}, -2.05),
    ],
)
def test_the_description_says_what_messages_hold(tmp_path: Path, keys: dict[str, Any], output: float) -> None:
    sensors = {spec.name: spec for spec in load_config(write(tmp_path, **keys)).sensors}
    plain = {spec.name: spec for spec in load_config(ARM).sensors}["upper_strain"]
    gauge = sensors["upper_strain"]
    assert gauge.output == pytest.approx(output, rel=1e-15)
    assert (gauge.sigma, gauge.limit, gauge.high) == (plain.sigma, plain.limit, plain.high)  # still strain
    assert {spec.output for name, spec in sensors.items() if name != "upper_strain"} == {1.0}


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"gauge_factor": 2.0}, "sensors.upper_strain.bridge: is missing"),
        ({"bridge": "half"}, "sensors.upper_strain.gauge_factor: is missing"),
        ({"gauge_factor": 2.0, "bridge": "three"}, "bridge: 'three': expected one of quarter, half, full"),
        ({"gauge_factor": 0, "bridge": "half"}, "gauge_factor: 0: expected 0.1 to 1000, or its negative"),
        ({"gauge_factor": 2e4, "bridge": "half"}, "gauge_factor: 20000.0: expected 0.1 to 1000"),
        ({"gauge_factor": "2 mV/V", "bridge": "half"}, "gauge_factor: '2 mV/V': unit 'mV/V' is not one of"),
    ],
)
def test_half_a_bridge_is_refused(tmp_path: Path, keys: dict[str, Any], words: str) -> None:
    assert words in refusal(write(tmp_path, **keys))


def test_other_sensors_have_no_bridge(tmp_path: Path) -> None:
    content = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    content["sensors"]["shoulder_encoder"]["bridge"] = "half"
    assert "sensors.shoulder_encoder.bridge: 'half': unknown key" in refusal(write_arm(tmp_path, content))
