"""Rayleigh damping: alpha / (2 omega) + beta omega / 2 in every mode of every realisation of the arm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from arms import FOLDER, arm
from descriptions import refusal, write_arm
from fe_beams import RIGID, strip
from fe_bodies import bracket, load_body
from fe_bodies import write_arm as write_solid_arm
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import io
from scipy.linalg import eigh

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.sid_file import read_sid, write_sid
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imported_body import ImportedBody, MatrixFile
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linear_assembly import assemble
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.modal_damping import Losses, modal_damping
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
ALPHA, BETA = 0.7, 3e-5
TWO_LINK = FOLDER.parents[3] / "docs/two_link.yaml"


def expected(omega: Array) -> Array:
    return ALPHA / (2 * omega) + BETA * omega / 2


def damped(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return an arm all of whose beams have the two factors, and whose axes do not damp."""
    said = {"damping_ratio": 0.0, "damping_time": BETA, "damping_rate": ALPHA}
    bodies = {
        name: replace(body, **said) if isinstance(body, Beam) else body
        for name, body in config.bodies.items()
    }
    joints = tuple(
        replace(joint, axes=tuple(replace(axis, damping=0.0) for axis in joint.axes))
        for joint in config.joints
    )
    return replace(config, bodies=bodies, joints=joints, gravity=np.zeros(3))


def locked(M: Array, D: Array, K: Array, free: NDArray[np.intp]) -> tuple[Array, Array]:
    """Return frequencies and ratios of the modes of some coordinates, and check that D couples none."""
    M, D, K = (matrix[np.ix_(free, free)] for matrix in (M, D, K))
    value, Phi = eigh((K + K.T) / 2, M)
    omega, modal = np.sqrt(value), Phi.T @ D @ Phi
    assert modal == pytest.approx(np.diag(np.diag(modal)), abs=1e-6 * abs(modal).max())
    return omega, np.diag(modal) / (2 * omega)


@pytest.mark.parametrize("name", ["single_link", "planar", "spatial"])
def test_every_served_mode_has_the_ratio_of_the_two_factors(name: str) -> None:
    model = linearize(ReducedTree(damped(arm(name)), use_compiler=False))
    assert model.omega.size > 1
    assert model.zeta == pytest.approx(expected(model.omega), rel=1e-3)


@pytest.mark.parametrize("name", ["single_link", "planar", "spatial"])
def test_so_has_every_mode_of_the_segment_tree(name: str) -> None:
    tree = SegmentTree(damped(arm(name)), 4)
    e = np.setdiff1d(np.arange(tree.n_q), tree.actuated)
    omega, zeta = locked(tree.mass_matrix(tree.close(tree.config.home)), tree.D, tree.K, e)
    assert zeta == pytest.approx(expected(omega), rel=1e-6)


def test_so_has_every_mode_of_the_linear_assembly() -> None:
    config = damped(load_config(TWO_LINK))
    M, D, K = assemble(config).locked()
    omega, zeta = locked(M, D, K, np.arange(M.shape[0]))
    assert zeta == pytest.approx(expected(omega), rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 5), st.floats(0.0, 10.0), st.floats(0.0, 0.2), st.integers(0, 2**32 - 1))
def test_one_rate_is_alpha_times_the_mass(n: int, alpha: float, ratio: float, seed: int) -> None:
    """With all that strains losing alike, D is alpha M; a ratio beside it adds what it adds alone."""
    rng = np.random.default_rng(seed)
    M, K = (a @ a.T + np.eye(n) for a in rng.standard_normal((2, n, n)))
    Z, names, none = np.eye(n), [f"q{i}" for i in range(n)], np.zeros((n, n))
    alone = modal_damping(M, K, Losses(ratio * K, none), Z, names)
    D = modal_damping(M, K, Losses(ratio * K, alpha * K), Z, names)
    assert D - alone == pytest.approx(alpha * M, rel=1e-9, abs=1e-9)


def test_a_mode_takes_the_rate_of_the_body_that_it_strains() -> None:
    config = damped(load_config(TWO_LINK))
    bodies = {**config.bodies, "upper": replace(config.bodies["upper"], damping_rate=0.0, damping_time=0.0)}
    bodies["forearm"] = replace(bodies["forearm"], damping_time=0.0)
    tree = ReducedTree(replace(config, bodies=bodies), use_compiler=False)
    model = linearize(tree)
    for k, (omega, zeta) in enumerate(zip(model.omega, model.zeta, strict=True)):
        strain = np.diag(tree.K) * model.Phi[:, len(model.theta_names) + k] ** 2
        own = [name.startswith("forearm.") for name in tree.coordinates]
        assert zeta == pytest.approx(ALPHA / (2 * omega) * strain[own].sum() / strain.sum(), rel=1e-2)


def write(folder: Path, **keys: Any) -> Path:
    content = yaml.safe_load(TWO_LINK.read_text(encoding="utf-8"))
    for name in ("upper", "forearm"):
        content["bodies"][name].pop("damping_ratio")
        content["bodies"][name].update(keys)
    return write_arm(folder, content)


def test_the_description_says_it(tmp_path: Path) -> None:
    told = {"alpha": f"{ALPHA} 1/s", "beta": f"{BETA * 1e6} us"}
    model = linearize(ReducedTree(load_config(write(tmp_path, rayleigh=told)), use_compiler=False))
    assert model.zeta == pytest.approx(expected(model.omega), rel=1e-6)
    both = load_config(write(tmp_path, rayleigh=told, damping_ratio="1 %"))
    model = linearize(ReducedTree(both, use_compiler=False))
    assert model.zeta == pytest.approx(0.01 + expected(model.omega), rel=1e-6)


def test_beta_alone_is_enough(tmp_path: Path) -> None:
    """As the page says; the ratio "must be given" was the answer."""
    model = linearize(ReducedTree(load_config(write(tmp_path, damping_time="20 us")), use_compiler=False))
    assert model.zeta == pytest.approx(20e-6 * model.omega / 2, rel=1e-6)


def test_two_measured_ratios_give_the_factors_as_the_page_says() -> None:
    model = linearize(ReducedTree(damped(load_config(TWO_LINK)), use_compiler=False))
    (w1, w2), (zeta1, zeta2) = model.omega[:2], model.zeta[:2]
    beta = 2 * (zeta2 * w2 - zeta1 * w1) / (w2**2 - w1**2)
    assert beta == pytest.approx(BETA, rel=1e-6)
    assert 2 * zeta1 * w1 - beta * w1**2 == pytest.approx(ALPHA, rel=1e-6)


FACTORS = {"alpha": "1 1/s", "beta": "1 us"}


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({}, "bodies.upper.damping_ratio: is missing"),
        ({"rayleigh": {"alpha": "1 1/s"}}, "bodies.upper.rayleigh.beta: is missing"),
        ({"rayleigh": {**FACTORS, "alpha": 1}}, "rayleigh.alpha: 1: has no unit after a space; expected"),
        ({"rayleigh": {**FACTORS, "alpha": "-1 1/s"}}, "rayleigh.alpha: '-1 1/s': must be at least 0"),
        ({"rayleigh": {**FACTORS, "beta": "1 1/s"}}, "rayleigh.beta: '1 1/s': unit '1/s' is not one of time"),
        ({"rayleigh": {**FACTORS, "gamma": 1}}, "rayleigh.gamma: 1: unknown key; allowed here: alpha, beta"),
        ({"rayleigh": FACTORS, "damping_time": "1 us"}, "upper.damping_time: '1 us': is rayleigh.beta"),
    ],
)
def test_what_is_no_pair_of_factors_is_refused(tmp_path: Path, keys: dict[str, Any], words: str) -> None:
    assert words in refusal(write(tmp_path, **keys))


def test_an_imported_body_is_damped_as_by_the_matrix_of_the_two_factors(tmp_path: Path) -> None:
    solid, both = bracket(), {"root", "end"}
    body = load_body(tmp_path, solid)
    assert isinstance(body, ImportedBody)
    matrix = (ALPHA * solid.M + BETA * solid.K).tocoo()
    io.mmwrite(tmp_path / "damping.mtx", matrix, precision=17)
    given_ = reduce_body(replace(body, damping=MatrixFile(tmp_path / "damping.mtx")), both)
    factors = {"alpha": f"{ALPHA} 1/s", "beta": f"{BETA} s"}
    told = load_body(tmp_path, solid, rayleigh=factors)
    said = reduce_body(told, both)
    assert np.diag(said.own_damping) == pytest.approx(np.diag(given_.own_damping), rel=1e-9)


def test_the_key_counts_the_payload_and_a_matrix_its_own_body_alone(tmp_path: Path) -> None:
    """Of a strip of 97 g with 200 g at its end; the page said that both are the same."""
    solid, mass = strip(20, tip_mass=0.0), 0.2  # kg
    M, K = (matrix.toarray()[6:, 6:] for matrix in (solid.M, solid.K))  # its root held
    D = ALPHA * M + BETA * K
    M[-6:-3, -6:-3] += mass * np.eye(3)
    value, phi = eigh(K, M, subset_by_index=(0, 1))
    omega = np.sqrt(value)
    own = np.einsum("ik,ij,jk->k", phi, D, phi) / (2 * omega)
    content = yaml.safe_load(write_solid_arm(tmp_path, solid, interfaces=RIGID).read_text(encoding="utf-8"))
    io.mmwrite(tmp_path / "damping.mtx", ALPHA * solid.M + BETA * solid.K, precision=17, symmetry="symmetric")
    content["bodies"]["payload"] = {"type": "rigid", "mass": f"{mass} kg"}
    del content["bodies"]["solid"]["damping_ratio"], content["joints"]["flange"]["orientation"]
    zeta = []
    factors = {"alpha": f"{ALPHA} 1/s", "beta": f"{BETA} s"}
    for said in ({"rayleigh": factors}, {"damping": {"file": "damping.mtx"}}):
        arm_ = {**content, "bodies": {**content["bodies"], "solid": {**content["bodies"]["solid"], **said}}}
        model = linearize(ReducedTree(load_config(write_arm(tmp_path, arm_)), use_compiler=False))
        assert model.omega[:2] == pytest.approx(omega, rel=1e-4)
        zeta.append(model.zeta[:2])
    assert zeta[0] == pytest.approx(expected(omega), rel=1e-3)
    assert zeta[1] == pytest.approx(own, rel=1e-3)
    key, matrix = (np.array(zeta) - BETA * omega / 2)[:, 0]  # what alpha does
    print(f"alpha of the key damps the first mode {key / matrix:.1f} times as much as that of the matrix")
    assert key / matrix == pytest.approx(9.7, abs=0.05)  # as the page says


def test_a_file_of_standard_input_data_keeps_the_rate(tmp_path: Path) -> None:
    body = reduce_body(damped(load_config(TWO_LINK)).bodies["upper"], {"root", "end"})
    write_sid(body, tmp_path / "upper.sid")
    back = read_sid(tmp_path / "upper.sid")
    assert back.damping_rate == ALPHA and np.array_equal(back.own_damping, body.own_damping)
    part = (tmp_path / "upper.sid").read_text(encoding="utf-8").partition("\nflexarm\n")[0]
    (tmp_path / "upper.sid").write_text(part + "\n", encoding="utf-8")
    foreign = read_sid(tmp_path / "upper.sid")  # De of the body alone is all that others know
    assert np.diag(foreign.D) == pytest.approx(2 * body.omega * expected(body.omega), rel=1e-12)
