"""Eigenvectors, exponential, pivots and blocks equal SciPy's."""

import numpy as np
import pytest
from scipy import linalg

from flexarm_model.numeric.dense import block_diagonal, eigh, expm, pivots


@pytest.mark.parametrize("n", [1, 4, 30])
def test_generalised_eigenvectors_are_mass_normalised_and_equal_scipys(n: int) -> None:
    rng = np.random.default_rng(n)
    root, shape = rng.normal(size=(2, n, n))
    M, K = root @ root.T + np.eye(n), shape @ shape.T
    values, vectors = eigh(K, M)
    expected = linalg.eigh(K, M)[0]
    np.testing.assert_allclose(values, expected, rtol=0.0, atol=1e-12 * expected[-1])
    np.testing.assert_allclose(vectors.T @ M @ vectors, np.eye(n), atol=1e-11)
    np.testing.assert_allclose(K @ vectors, M @ vectors * values, atol=1e-10 * abs(K).max())


def test_a_mass_that_is_not_positive_definite_is_refused() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        eigh(np.eye(2), np.diag([1.0, -1.0]))


def test_the_exponential_of_a_turn_is_the_turn() -> None:
    for angle in (0.0, 1e-9, 0.3, 3.0, 40.0):
        c, s = np.cos(angle), np.sin(angle)
        turned = expm(np.array([[0.0, -angle], [angle, 0.0]]))
        np.testing.assert_allclose(turned, [[c, -s], [s, c]], atol=2e-16 * max(angle, 5.0) * 8)


def test_the_exponential_equals_scipys_over_the_scales_of_an_arm() -> None:
    rng = np.random.default_rng(3)
    for scale in (1e-6, 1e-2, 1.0, 10.0):
        A = scale * rng.normal(size=(9, 9))
        expected = linalg.expm(A)
        np.testing.assert_allclose(expm(A), expected, rtol=0.0, atol=1e-11 * abs(expected).max())


@pytest.mark.parametrize("shape", [(3, 7), (7, 3), (5, 5), (4, 1), (0, 3), (3, 0)])
def test_pivots_are_those_of_lapack(shape: tuple[int, int]) -> None:
    A = np.random.default_rng(1).normal(size=shape)
    order, lengths = pivots(A)
    if not A.size:
        assert order.tolist() == list(range(shape[1])) and lengths.size == 0
        return
    _, R, expected = linalg.qr(A, mode="economic", pivoting=True)
    k = min(shape)
    assert order[:k].tolist() == expected[:k].tolist()
    np.testing.assert_allclose(lengths, abs(np.diag(R)), rtol=1e-12)


def test_pivots_tell_the_rank() -> None:
    rng = np.random.default_rng(2)
    A = rng.normal(size=(6, 2)) @ rng.normal(size=(2, 5))
    lengths = pivots(A)[1]
    assert lengths[1] > 0.1 and lengths[2] < 1e-14 * lengths[0]


@pytest.mark.parametrize("shapes", [[], [(2, 2)], [(2, 3), (1, 1), (0, 0), (3, 2)], [(0, 2), (2, 0)]])
def test_blocks_stand_along_the_diagonal_as_scipy_puts_them(shapes: list[tuple[int, int]]) -> None:
    blocks = [np.random.default_rng(4).normal(size=shape) for shape in shapes]
    size = sum(rows for rows, _ in shapes), sum(columns for _, columns in shapes)
    np.testing.assert_array_equal(block_diagonal(*blocks), linalg.block_diag(*blocks).reshape(size))
