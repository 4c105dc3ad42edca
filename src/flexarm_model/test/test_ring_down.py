"""What rings down after one hit is told from what is shaken, knocked several times, or switched off."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_model.identification.ring_down import rings_down

T = np.arange(0.0, 30.0, 0.01)
NOISE = np.random.default_rng(0).standard_normal((T.size, 2))


def rung(begin: float, decay: float) -> np.ndarray:
    """Return two outputs that ring from an instant [s] on, with a decay [1/s], (samples, 2)."""
    late = np.maximum(T - begin, 0.0)
    one = np.where(begin <= T, np.exp(-decay * late) * np.sin(30.0 * late), 0.0)
    return np.stack([one, -1e-6 * one], axis=1)


@pytest.mark.parametrize(
    ("y", "expected"),
    [
        (rung(0.0, 0.3), True),
        (rung(0.0, 0.3) + 0.5, True),  # a standing offset
        (rung(8.0, 0.5), True),  # hit while the record ran
        (rung(0.0, 0.3) + 1e-2 * NOISE * [1.0, 1e-6], True),
        (rung(0.0, 0.05), False),  # cut off while it rings
        (NOISE, False),
        (NOISE * (T < 26.0)[:, None], False),  # switched off
        (rung(0.0, 0.5) + rung(9.0, 0.5) + rung(18.0, 0.5), False),
        (np.ones((3000, 1)), False),
    ],
)
def test_a_record_that_rings_down_is_told_from_others(y: np.ndarray, expected: bool) -> None:
    assert rings_down(y) is expected
