"""Rules of retuning: each against something that is not the rule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from flexarm_bringup.retune.arm_facts import ArmFacts, read_facts
from flexarm_bringup.retune.horizon import fit_horizon, spread_blocks
from flexarm_bringup.retune.moves_text import with_settings, write_number
from flexarm_bringup.retune.noise import LEAST, fit_noise, frequency_doubt
from flexarm_bringup.retune.shaping import choose_shaper, vibration_left
from flexarm_bringup.retune.weights import scale_weights
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.identification.model_update import Update
from flexarm_model.identification.unknown import Unknown
from flexarm_model.motion.shapers import zv, zvd
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

MPC, DT = MpcConfig(), 0.005
E_MODULUS = "bodies.strip.pieces.0.youngs_modulus"


def facts(**changes: str) -> ArmFacts:
    config = load_config(find_manipulator("single_link"), "geared", changes)
    return read_facts(linearize(ReducedTree(config, use_compiler=False)))


def scaled(given: ArmFacts, frequency: float, stiffness: float) -> ArmFacts:
    return ArmFacts(given.f_hz * frequency, given.zeta, given.tip_stiffness * stiffness)


@pytest.fixture(scope="module")
def strip() -> ArmFacts:
    return facts()


def test_compliances_of_the_modes_add_up_to_that_of_a_cantilever(strip: ArmFacts) -> None:
    """Statics: 3 EI / L^3 = 12.7 N/m; three modes lack half a per cent of the compliance."""
    EI = 208.5e9 * 0.02 * 0.0032**3 / 12
    assert np.sum(1 / strip.tip_stiffness) == pytest.approx(0.63**3 / (3 * EI), rel=0.01)


def test_no_force_at_the_tip_bends_modes_that_move_it_by_rounding_only() -> None:
    model = linearize(ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False))
    C_pos = model.outputs.C_pos.copy()
    C_pos[model.outputs.rows("tip"), model.n_theta :] *= 1e-12
    told = read_facts(replace(model, outputs=replace(model.outputs, C_pos=C_pos)))
    assert np.isinf(told.tip_stiffness).all()


def test_a_softer_strip_makes_the_energy_of_the_same_deflection_smaller(strip: ArmFacts) -> None:
    """Stiffness is proportional to the modulus, frequency to its root, whatever the masses."""
    changed = scale_weights(MPC, strip, facts(**{E_MODULUS: "156.375 GPa"}))
    assert changed.modal_energy == pytest.approx(0.75 * MPC.modal_energy, rel=1e-3)
    assert changed.modal_cutoff_hz == pytest.approx(np.sqrt(0.75) * MPC.modal_cutoff_hz, rel=1e-3)


def test_an_arm_that_is_as_described_keeps_its_settings(strip: ArmFacts) -> None:
    assert fit_horizon(scale_weights(MPC, strip, strip), strip, strip, DT) == MPC


@pytest.mark.parametrize(("ratio", "horizon"), [(0.8, 50), (1.25, 32), (0.1, 400)])
def test_the_horizon_covers_the_same_share_of_the_slowest_period(
    strip: ArmFacts, ratio: float, horizon: int
) -> None:
    changes = fit_horizon(MPC, strip, scaled(strip, ratio, 1.0), DT)
    assert changes.horizon == horizon
    assert changes.blocks[:4] == (1,) * 4  # valid, and as fine at once as before


def test_a_short_horizon_grows_to_half_a_period(strip: ArmFacts) -> None:
    short = replace(MPC, horizon=4, blocks=(1,) * 4)
    assert fit_horizon(short, strip, strip, DT).horizon == np.ceil(0.5 / strip.f_hz[0] / DT)


@pytest.mark.parametrize("horizon", [2, 7, 40, 61, 199])
def test_blocks_fill_any_horizon_without_more_of_them(horizon: int) -> None:
    blocks = spread_blocks(MPC.blocks, horizon)
    assert sum(blocks) == horizon and min(blocks) >= 1 and len(blocks) <= len(MPC.blocks)


def update(sigma: list[float], after: list[float]) -> Update:
    unknowns = tuple(Unknown(f"p{i}", 1.0, "", 0.3) for i in range(len(sigma)))
    S = np.array([[0.5, -0.2], [0.5, -0.1]])
    return Update(unknowns, np.zeros(2), np.array(sigma), np.eye(2), S, np.zeros(2), np.array(after), {})


def test_what_is_not_known_of_frequencies_is_carried_over_from_the_parameters() -> None:
    assert frequency_doubt(update([0.02, 0.05], [0.0, 0.0])) == pytest.approx(np.hypot(0.01, 0.01))
    assert frequency_doubt(update([0.0, 0.0], [0.003, -0.003])) == pytest.approx(0.003)
    assert frequency_doubt(update([0.02, 0.29], [0.0, 0.0])) == pytest.approx(0.01)  # the second is not told


def test_the_filter_bears_three_sigma_and_never_more_than_before() -> None:
    settings = EstimatorConfig(frequency_error=0.1)
    assert fit_noise(settings, 0.01).frequency_error == pytest.approx(0.03)
    assert fit_noise(settings, 0.2).frequency_error == 0.1
    assert fit_noise(settings, 0.0).frequency_error == LEAST


@pytest.mark.parametrize("off", [1.0, 1.1])
def test_what_a_shaper_leaves_is_what_an_oscillator_rings_with(off: float) -> None:
    """Oscillator under the impulses, summed up in real numbers; without damping energy is the oracle."""
    omega = 2 * np.pi * 5.0
    for shaper in (zv(omega, 0.0), zvd(omega, 0.0)):
        w, t = omega * off, shaper.duration
        pairs = list(zip(shaper.delays, shaper.amplitudes, strict=True))
        x = sum(a * np.sin(w * (t - d)) for d, a in pairs)
        v = sum(a * np.cos(w * (t - d)) for d, a in pairs)
        assert vibration_left(shaper, w, 0.0) == pytest.approx(np.hypot(x, v), abs=1e-12)


def test_a_well_known_frequency_takes_the_shortest_shaper_and_a_doubtful_one_a_longer() -> None:
    names = [choose_shaper(4.3, 0.02, doubt).shaper.name for doubt in (0.001, 0.02, 0.06)]
    assert names == ["ZV", "ZVD", "EI"]


def test_every_damping_has_a_shaper() -> None:
    """EI has no positive impulses from a damping ratio of about 0.9 on; the whole proposal was refused."""
    assert choose_shaper(4.3, 0.95, 0.02).shaper.name == "ZV"
    assert choose_shaper(4.3, 1.2, 0.02).shaper.delays == (0.0,)


def test_settings_go_into_a_moves_file_and_its_comments_stay(tmp_path) -> None:
    old = find_task("single_link").read_text(encoding="utf-8")
    values = {"mpc": {"horizon": 49, "modal_energy": 9e-5, "blocks": (1,) * 49}, "schedule": {"angle": 0.1}}
    path = tmp_path / "moves.yaml"
    path.write_text(with_settings(old, values, "my_arm.yaml"), encoding="utf-8")
    task = load_task(path)
    assert task.manipulator == "my_arm.yaml" and task.settings["schedule"]["angle"] == 0.1
    mpc = task.make("mpc", MpcConfig)
    assert (mpc.horizon, mpc.modal_energy, len(mpc.blocks)) == (49, 9e-5, 49)
    before, after = (yaml.safe_load(text) for text in (old, path.read_text(encoding="utf-8")))
    assert (
        after["moves"] == before["moves"]
        and after["settings"]["estimator"] == before["settings"]["estimator"]
    )
    comments = [line.partition("#")[2] for line in old.splitlines() if "#" in line]
    assert all(comment in path.read_text(encoding="utf-8") for comment in comments)


def test_settings_of_a_preset_that_has_its_own_go_there_and_nowhere_else(tmp_path) -> None:
    old = find_task("single_link").read_text(encoding="utf-8")
    path = tmp_path / "moves.yaml"
    path.write_text(with_settings(old, {"mpc": {"horizon": 9}}, "a.yaml", "light_hub"), encoding="utf-8")
    before, after = (yaml.safe_load(text) for text in (old, path.read_text(encoding="utf-8")))
    assert after["preset_settings"]["light_hub"]["mpc"].pop("horizon") == 9
    assert {**after, "manipulator": 0} == {**before, "manipulator": 0}


@pytest.mark.parametrize("name", ["planar_3rrr", "serial_6r", "spatial_3tpt", "variable_stiffness"])
def test_every_moves_file_that_comes_along_takes_settings(name: str) -> None:
    old = find_task(name).read_text(encoding="utf-8")
    new = with_settings(old, {"mpc": {"modal_energy": 1.25e-5}, "estimator": {"gate": 7.5}}, "x.yaml")
    content = yaml.safe_load(new)
    assert content["settings"]["mpc"]["modal_energy"] == 1.25e-5
    assert content["settings"]["estimator"]["gate"] == 7.5


@pytest.mark.parametrize("value", [1.2e-5, 1e-5, 0.25, 12345678.0, (1, 2), 3])
def test_numbers_are_read_back_as_numbers(value) -> None:
    read = yaml.safe_load(write_number(value))
    assert read == (list(value) if isinstance(value, tuple) else pytest.approx(value, rel=1e-5))
    assert not isinstance(read, str)
