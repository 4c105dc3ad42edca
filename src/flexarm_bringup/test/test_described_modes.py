"""An arm whose modes are damped too much to be found is told from one whose measurement is bad."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup import cli
from flexarm_bringup.identify.described_modes import described_modes, no_resonance

BAND = (5.0, 78.0)  # Hz


def test_modes_of_a_description_are_those_that_it_is_compared_with() -> None:
    f_hz, zeta = described_modes("single_link", "geared", (), False)
    assert f_hz[:2] == pytest.approx([5.749, 36.314], rel=1e-4)
    assert zeta[:2] == pytest.approx([0.0165, 0.0150], rel=0.01)
    assert not no_resonance(f_hz, zeta, BAND, False)
    assert described_modes("", "", (), False)[0].size == 0


def test_an_arm_without_a_mode_that_can_be_found_is_told_with_its_damping() -> None:
    f_hz, zeta = described_modes("variable_stiffness", "", (), False)
    assert "with free motors" in no_resonance(f_hz, zeta, BAND, False)
    assert "(13.73 Hz with 59 %)" in no_resonance(f_hz, zeta, BAND, False)
    assert "with held motors" in no_resonance(f_hz, zeta, BAND, True)
    assert "(none oscillates)" in no_resonance(f_hz, zeta, (20.0, 78.0), False)


def test_one_mode_that_can_be_found_is_enough() -> None:
    f_hz, zeta = np.array([10.0, 20.0]), np.array([0.5, 0.15])
    assert not no_resonance(f_hz, zeta, BAND, False)
    assert no_resonance(f_hz, zeta, (5.0, 15.0), False)


def test_the_page_tells_why_the_described_arm_shows_no_mode(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Only that nothing stands out of the noise was said, after 80 s of excitation."""
    rng, path = np.random.default_rng(3), tmp_path / "run.npz"
    shaken, noise = rng.standard_normal((2, 1200))
    np.savez(path, t=np.arange(1200) * 0.005, **{"in:shoulder.rz": shaken, "out:gauge": noise + shaken})
    words = ["identify", path, "--manipulator", "variable_stiffness", "--kind", "receptance"]
    assert cli.main([*map(str, words), "--band", "5", "40"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "no mode stands out of the noise" in said and "13.73 Hz with 59 %" in said and "--joints" in said
