"""MAC, subspaces and tracking: properties for any shapes, and systems whose modes are known."""

from __future__ import annotations

import numpy as np
import pytest
from arms import tree
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import subspace_angles

from flexarm_model.modal.mac import align_rotation, align_signs, auto_mac, mac
from flexarm_model.modal.modes import Modes, normal_modes
from flexarm_model.modal.tracking import Tracks, group_modes, track_modes
from flexarm_model.served.linearize import linearize

PROPERTY = settings(deadline=None, derandomize=True, max_examples=60)
NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False)
FACTORS = st.floats(1e-12, 1e12) | st.floats(-1e12, -1e-12)


def shapes() -> st.SearchStrategy[np.ndarray]:
    """Return real or complex shapes, (5, 3), none of them zero."""
    real = arrays(float, (5, 3), elements=NUMBERS)
    both = st.tuples(real, real).map(lambda parts: parts[0] + 1j * parts[1])
    return (real | both).filter(lambda value: bool((abs(value).max(axis=0) > 1e-3).all()))


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@PROPERTY
@given(shapes(), shapes())
def test_mac_lies_between_0_and_1_and_does_not_care_for_the_order(a: np.ndarray, b: np.ndarray) -> None:
    values = mac(a, b)
    assert values.shape == (3, 3) and (values >= 0.0).all() and (values <= 1.0).all()
    assert values == pytest.approx(mac(b, a).T, abs=1e-12)
    assert np.diag(auto_mac(a)) == pytest.approx(np.ones(3), abs=1e-12)


@PROPERTY
@given(shapes(), shapes(), FACTORS, st.floats(0.0, 6.3))
def test_mac_does_not_depend_on_scale_sign_or_phase(
    a: np.ndarray, b: np.ndarray, factor: float, phase: float
) -> None:
    assert mac(a * factor, b * np.exp(1j * phase)) == pytest.approx(mac(a, b), abs=1e-10)


@PROPERTY
@given(shapes(), shapes())
def test_mac_is_the_squared_cosine_between_two_shapes(a: np.ndarray, b: np.ndarray) -> None:
    cosine = np.cos(subspace_angles(a[:, :1], b[:, :1])[0])
    assert mac(a[:, :1], b[:, :1])[0, 0] == pytest.approx(cosine**2, abs=1e-9)


def test_modes_are_orthogonal_in_the_mass_and_not_without_it() -> None:
    M = np.array([[1.0, 0.3, 0.0], [0.3, 5.0, -0.2], [0.0, -0.2, 0.2]])
    K = np.array([[3.0, -1, 0], [-1, 2, -1], [0, -1, 4]])
    modes = normal_modes(M, 0 * M, K).shapes
    assert auto_mac(modes, M) == pytest.approx(np.eye(3), abs=1e-12)
    assert abs(auto_mac(modes) - np.eye(3)).max() > 0.05


def test_mac_of_two_known_vectors_is_the_textbook_value() -> None:
    a, b = np.array([[1.0], [2.0]]), np.array([[3.0], [1.0]])
    assert mac(a, b)[0, 0] == pytest.approx(25 / (5 * 10))


def test_a_turned_pair_is_turned_back_and_signs_are_restored() -> None:
    pair = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 2)))[0]
    turned = pair @ rotation(1.1)
    assert mac(pair, turned)[0, 0] < 0.5  # mode by mode they look like others
    assert subspace_angles(pair, turned).max() < 1e-12
    assert align_rotation(turned, pair) == pytest.approx(pair)
    assert align_signs(pair * [-1.0, 1.0], pair) == pytest.approx(pair)
    assert align_signs(pair * np.exp(1j), pair) == pytest.approx(pair)


def test_shapes_that_say_nothing_are_refused() -> None:
    with pytest.raises(ValueError, match="shape 1 is zero or not finite"):
        mac(np.array([[1.0, 0.0], [1.0, 0.0]]), np.eye(2))
    with pytest.raises(ValueError, match="shapes of 2 and 3 values"):
        mac(np.eye(2), np.eye(3))


def crossing(coupling: float, poses: int = 41) -> Tracks:
    """Return tracks of two oscillators whose stiffnesses cross half way, and a third that stays."""
    series = []
    for stiffness in np.linspace(1.0, 3.0, poses):
        K = np.array([[stiffness, coupling, 0.0], [coupling, 4.0 - stiffness, 0.0], [0.0, 0.0, 9.0]])
        series.append(normal_modes(np.eye(3), np.zeros((3, 3)), K))
    return track_modes(series)


def test_modes_keep_their_number_where_frequencies_cross() -> None:
    tracks = crossing(0.0)
    assert tracks.omega[:, 0] ** 2 == pytest.approx(np.linspace(1.0, 3.0, 41))
    assert tracks.omega[:, 1] ** 2 == pytest.approx(np.linspace(3.0, 1.0, 41))
    assert tracks.order[0].tolist() == [0, 1, 2] and tracks.order[-1].tolist() == [1, 0, 2]
    assert tracks.shapes == pytest.approx(np.broadcast_to(tracks.shapes[0], tracks.shapes.shape), abs=1e-6)
    assert not tracks.unclear.any() and tracks.mac.min() > 0.999


def test_frequencies_that_veer_keep_their_order_and_exchange_their_shapes() -> None:
    tracks = crossing(0.2)
    assert (tracks.order == [0, 1, 2]).all()
    assert mac(tracks.shapes[0], tracks.shapes[-1])[0, 0] < 0.1


def test_a_double_mode_that_the_solver_turns_at_will_is_followed() -> None:
    """A symmetric platform: the solver may return any rotation of the doublet at every pose."""
    rng = np.random.default_rng(4)
    series = []
    for split in np.linspace(-1e-2, 1e-2, 21):  # exactly double half way, mixed at random there
        omega = np.array([20.0 - split, 20.0 + split, 5.0])
        shapes = np.eye(3)
        if abs(split) < 1e-9:
            shapes[:2, :2] = rotation(rng.uniform(0.0, 6.0))
        order = np.argsort(omega, kind="stable")
        series.append(Modes(omega[order], np.zeros(3), shapes[:, order] * rng.choice([-1.0, 1.0], 3)))
    tracks = track_modes(series)
    assert tracks.mac == pytest.approx(np.ones((21, 3)))
    change = np.broadcast_to([0.0, 1e-3, -1e-3], (20, 3))  # the slower one of the pair rises
    assert np.diff(tracks.omega, axis=0) == pytest.approx(change, abs=1e-9)
    assert np.diff(tracks.shapes, axis=0) == pytest.approx(np.zeros((20, 3, 3)), abs=1e-12)


def test_a_threefold_mode_is_turned_back_onto_where_it_came_from() -> None:
    rng = np.random.default_rng(8)
    start = Modes(
        np.array([1.0, 3.0, 3.1, 3.2, 7.0]), np.zeros(5), np.linalg.qr(rng.standard_normal((6, 5)))[0]
    )
    shapes = start.shapes.copy()
    shapes[:, 1:4] = shapes[:, 1:4] @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    tracks = track_modes([start, Modes(np.array([1.0, 3.0, 3.0, 3.0, 7.0]), np.zeros(5), shapes)])
    assert tracks.shapes[1] == pytest.approx(start.shapes)
    assert tracks.mac[1] == pytest.approx(np.ones(5))


def test_a_mode_that_leaves_the_set_is_marked() -> None:
    stay, left, new = np.eye(4)[:, [0, 1]], np.eye(4)[:, [0, 2]], np.eye(4)[:, [0, 2]]
    series = [Modes(np.array([1.0, 2.0]), np.zeros(2), shape) for shape in (stay, left, new)]
    assert track_modes(series).unclear.tolist() == [[False, False], [False, True], [False, False]]
    with pytest.raises(ValueError, match="need poses with the same modes"):
        track_modes([*series, Modes(np.array([1.0]), np.zeros(1), np.eye(4)[:, :1])])


def test_the_mac_of_tracks_is_taken_in_the_mass() -> None:
    M = np.array([[1.0, 0.3], [0.3, 50.0]])
    start = normal_modes(M, 0 * M, np.diag([1.0, 300.0]))
    turned = Modes(start.omega, start.damping, start.shapes @ rotation(0.4))
    tracks = track_modes([start, turned], [M, M])
    assert tracks.mac[1] == pytest.approx(np.full(2, np.cos(0.4) ** 2))


def test_modes_of_a_moving_arm_are_followed_in_its_mass() -> None:
    arm = tree("spatial")
    series, weights = [], []
    for elbow in np.linspace(0.3, 1.5, 49):
        model = linearize(arm, np.array([0.0, -0.5, elbow]))
        series.append(Modes(model.omega, 2 * model.zeta * model.omega, model.Phi[:, model.n_theta :]))
        weights.append(np.array(arm.linearisation(model.q0)[0]))
    tracks = track_modes(series, weights)
    assert not tracks.unclear.any()
    assert tracks.mac.min() > 0.9
    assert abs(np.diff(np.log(tracks.omega), axis=0)).max() < 0.05  # 1.4 degrees apart: no jumps


def test_close_frequencies_form_groups() -> None:
    groups = group_modes(np.array([5.0, 1.0, 1.00005, 1.0001, 3.0]))
    assert [group.tolist() for group in groups] == [[1, 2, 3], [4], [0]]
