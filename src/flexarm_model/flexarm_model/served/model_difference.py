"""How far two served models are apart: is a new one worth sending?"""

from __future__ import annotations

from flexarm_model.served.reduced_model import ReducedModel


def model_difference(a: ReducedModel, b: ReducedModel) -> float:
    """Return the largest change of M, K or an output row, relative to its size [1]."""
    pairs = [(a.M, b.M), (a.K, b.K), (a.f0, b.f0)]
    pairs += [(getattr(a.outputs, name), getattr(b.outputs, name)) for name in ("C_pos", "C_vel", "C_acc")]
    return max(float(abs(x - y).max(initial=0.0) / max(abs(y).max(initial=0.0), 1.0)) for x, y in pairs)
