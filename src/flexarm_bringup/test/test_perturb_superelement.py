"""On the rig a body from a file differs as the body that it was made of: its own beam or matrices."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from imported_arm import write_arm
from scipy import io
from test_perturb import ARM

from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.sid_file import write_sid
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imported_body import ImportedBody, MatrixFile
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

OTHERS = (
    PlantSettings(extra_modes=0),
    PlantSettings(extra_modes=0, body_mass_scale=1.2),
    PlantSettings(extra_modes=0, frequency_scale=0.8**0.5),
    PlantSettings(extra_modes=0, frequency_scale=0.9),
    PlantSettings(extra_modes=0, frequency_scale=1.1),
    PlantSettings(extra_modes=0, damping_scale=2.0),
    PlantSettings(extra_modes=0, body_mass_scale=0.7, frequency_scale=1.2, damping_scale=3.0),
)
ROUNDING = 1e-9  # relative: two reductions of one beam


@pytest.fixture
def beam_arm(tmp_path: Path) -> ManipulatorConfig:
    """Return the arm with a strip that has every kind of damping."""
    (tmp_path / "beam.yaml").write_text(ARM, encoding="utf-8")
    config = load_config(tmp_path / "beam.yaml")
    strip = replace(config.bodies["strip"], damping_time=1e-4, damping_rate=0.4)
    return replace(config, bodies={**config.bodies, "strip": strip})


def same_from_file(config: ManipulatorConfig, folder: Path, own: bool = True) -> ManipulatorConfig:
    """Return the arm whose strip comes from a file, with the block of our own or without."""
    path = folder / "strip.sid"
    write_sid(reduce_body(config.bodies["strip"], {"root"}), path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text if own else text[: text.index("\nflexarm\n") + 1], encoding="utf-8")
    begin, end = ARM.index("    type: beam"), ARM.index("joints:")
    words = f"{ARM[:begin]}    type: superelement\n    file: strip.sid\n{ARM[end:]}"
    (folder / "file.yaml").write_text(words, encoding="utf-8")
    return load_config(folder / "file.yaml")


@pytest.mark.parametrize("settings", OTHERS)
def test_an_arm_with_a_superelement_differs_as_the_arm_with_its_beam(
    beam_arm: ManipulatorConfig, tmp_path: Path, settings: PlantSettings
) -> None:
    """Frequencies and masses of such a body stayed as described, and ``sim`` called the rows ok."""
    arms = (beam_arm, same_from_file(beam_arm, tmp_path))
    beam, file = (linearize(ReducedTree(perturb(arm, settings), use_compiler=False)) for arm in arms)
    assert file.omega == pytest.approx(beam.omega, rel=ROUNDING)
    assert file.zeta == pytest.approx(beam.zeta, rel=ROUNDING)
    described = linearize(ReducedTree(beam_arm, use_compiler=False)).omega
    factor = settings.frequency_scale / settings.body_mass_scale**0.5
    assert file.omega == pytest.approx(factor * described, rel=ROUNDING)


@pytest.mark.parametrize("settings", OTHERS)
def test_every_number_of_the_superelement_is_that_of_the_beam(
    beam_arm: ManipulatorConfig, tmp_path: Path, settings: PlantSettings
) -> None:
    arms = (beam_arm, same_from_file(beam_arm, tmp_path))
    beam, file = (reduce_body(perturb(arm, settings).bodies["strip"], {"root"}) for arm in arms)
    assert beam.pairs, "second-order fields are to be compared, too"
    assert_same(file, beam)


@pytest.mark.parametrize("settings", OTHERS)
def test_a_file_without_our_own_block_has_the_same_frequencies(
    beam_arm: ManipulatorConfig, tmp_path: Path, settings: PlantSettings
) -> None:
    arms = (beam_arm, same_from_file(beam_arm, tmp_path, own=False))
    beam, file = (linearize(ReducedTree(perturb(arm, settings), use_compiler=False)) for arm in arms)
    assert file.omega == pytest.approx(beam.omega, rel=ROUNDING)


@pytest.mark.parametrize("settings", OTHERS)
def test_an_imported_body_differs_as_its_superelement(tmp_path: Path, settings: PlantSettings) -> None:
    """Its mass stayed as described, and so did damping that a file gives."""
    config = load_config(write_arm(tmp_path / "arm.yaml"))
    solid = config.bodies["solid"]
    assert isinstance(solid, ImportedBody)
    K = io.mmread(solid.stiffness.path)
    io.mmwrite(tmp_path / "damping.mtx", 2e-6 * K, precision=17)
    damped = replace(solid, damping=MatrixFile(tmp_path / "damping.mtx"), damping_ratio=0.0)
    write_sid(reduce_body(damped, {"root"}), tmp_path / "strip.sid")
    begin, end = ARM.index("  strip:"), ARM.index("joints:")
    words = f"{ARM[:begin]}  solid: {{type: superelement, file: strip.sid}}\n{ARM[end:]}"
    words = words.replace("strip.root", "solid.root").replace("strip.end", "solid.root")
    (tmp_path / "file.yaml").write_text(words, encoding="utf-8")
    from_file = load_config(tmp_path / "file.yaml")
    imported = replace(from_file, bodies={**from_file.bodies, "solid": damped})
    matrices, file = (
        reduce_body(perturb(arm, settings).bodies["solid"], {"root"}) for arm in (imported, from_file)
    )
    assert_same(file, matrices)
    described = reduce_body(damped, {"root"})
    assert matrices.mass == pytest.approx(settings.body_mass_scale * described.mass, rel=ROUNDING)
    factor = settings.frequency_scale**2 / settings.body_mass_scale * settings.damping_scale
    assert np.diag(matrices.D) == pytest.approx(factor * np.diag(described.D), rel=1e-6)


def assert_same(one: Superelement, other: Superelement) -> None:
    """Compare all that two superelements hold; the sign of a mode is free."""
    sign = np.sign(np.einsum("ik,ik->i", one.s, other.s)[1 : one.n + 1])
    fields = np.concatenate([[1.0], sign, [sign[i] * sign[j] for i, j in one.pairs]])
    close = {"rel": ROUNDING, "abs": ROUNDING}
    assert one.mass == pytest.approx(other.mass, **close)
    assert one.s * fields[:, None] == pytest.approx(other.s, **close)
    P = one.P * np.multiply.outer(fields, fields)[:, :, None, None]
    assert pytest.approx(other.P, rel=1e-7, abs=ROUNDING) == P
    assert one.omega == pytest.approx(other.omega, **close)
    for name in ("K", "D"):
        a, b = getattr(one, name), getattr(other, name)
        assert abs(sign[:, None] * a * sign - b).max() <= 1e-7 * abs(b).max()
    assert (one.damping_ratio, one.damping_rate) == pytest.approx(
        (other.damping_ratio, other.damping_rate), **close
    )
    for name, node in other.nodes.items():
        assert one.nodes[name].Phi * sign == pytest.approx(node.Phi, **close)
        assert one.nodes[name].Psi * sign == pytest.approx(node.Psi, rel=1e-8, abs=1e-8)
        assert one.nodes[name].G * np.outer(sign, sign) == pytest.approx(node.G, rel=1e-7, abs=1e-7)
        assert one.nodes[name].strain * sign == pytest.approx(node.strain, rel=1e-7, abs=1e-7, nan_ok=True)
