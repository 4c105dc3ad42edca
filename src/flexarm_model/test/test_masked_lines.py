"""Lines of low coherence are not fitted: whatever stands there, the answer is the same to the last digit."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_frf import FINE, pair, poles_of_modes, with_noise

from flexarm_model.identification.automatic import identify_modes
from flexarm_model.identification.lscf import poles_of_orders
from flexarm_model.modal.fit import FitOptions, fit_poles
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.line_weights import repeated_weights, shared_weights
from flexarm_model.modal.residues import fit_residues


def spoilt() -> tuple[Frf, Frf, np.ndarray]:
    """Return responses, the same with nonsense in some cells, and weights (k, n_out) that mask those."""
    rng = np.random.default_rng(3)
    clean = with_noise(pair(8.0)[1], 40.0, rng)
    weight = np.ones(clean.H.shape[:2])
    weight[10:18, 0], weight[60:70, 2] = 0.0, 0.0
    weight[30] = 0.0
    nonsense = abs(clean.H).max() * (rng.standard_normal(clean.H.shape) + 3j)
    H = np.where(weight[:, :, None] > 0, clean.H, nonsense)
    return clean, Frf(clean.f_hz, H, clean.kind), weight


@pytest.mark.parametrize("rank_one", [True, False])
def test_nonsense_on_masked_cells_does_not_move_the_fit(rank_one: bool) -> None:
    clean, wrong, weight = spoilt()
    options = FitOptions(rank_one=rank_one, weight=weight)
    fits = [fit_poles(frf, poles_of_modes(pair(8.0)[0])[:2], None, options) for frf in (clean, wrong)]
    assert fits[1].model.poles == pytest.approx(fits[0].model.poles, rel=1e-9)
    assert fits[1].f_std_hz == pytest.approx(fits[0].f_std_hz, rel=1e-6)
    assert fits[1].model.error == pytest.approx(fits[0].model.error, rel=1e-6)


def test_nonsense_on_masked_cells_reaches_neither_chart_nor_choice() -> None:
    clean, wrong, weight = spoilt()
    first, second = (identify_modes(frf, weight).fit for frf in (clean, wrong))
    assert first is not None and second is not None
    assert second.model.f_hz == pytest.approx(first.model.f_hz, rel=1e-9)
    unmasked = identify_modes(wrong).fit
    assert unmasked is None or abs(unmasked.model.f_hz[0] / first.model.f_hz[0] - 1) > 1e-4


def test_weights_of_every_output_alike_are_weights_of_the_lines() -> None:
    clean, _, _ = spoilt()
    line = np.ones(FINE.size)
    line[20:25] = 0.0
    both = [line, np.repeat(line[:, None], 3, axis=1)]
    charts = [poles_of_orders(clean, range(6, 8), weight)[-1].poles for weight in both]
    assert charts[0] == pytest.approx(charts[1], rel=1e-6)
    poles = poles_of_modes(pair(8.0)[0])[:2]
    fits = [fit_residues(clean, poles, weight=weight).residues for weight in both]
    assert fits[0] == pytest.approx(fits[1], rel=1e-9)


def test_weights_of_other_outputs_are_refused() -> None:
    with pytest.raises(ValueError, match="weights of 2 outputs for 3"):
        shared_weights(np.ones((5, 2)), 3)


def test_an_output_that_has_become_several_columns_keeps_its_weights() -> None:
    """Columns stand output by output, the inputs of each side by side."""
    weight = np.array([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    shared = shared_weights(repeated_weights(weight, 2), 4)
    by_column = {int(k): part.weight for part in shared for k in part.outputs}
    for column, output in enumerate((0, 0, 1, 1)):
        assert np.array_equal(by_column[column], weight[:, output])


@pytest.mark.parametrize("orders", [range(0), range(3)])
def test_orders_that_are_none_are_refused(orders: range) -> None:
    """NumPy's words about broadcasting, or an IndexError."""
    with pytest.raises(ValueError, match="at least one, from 1 on"):
        poles_of_orders(pair(8.0)[1], orders)
