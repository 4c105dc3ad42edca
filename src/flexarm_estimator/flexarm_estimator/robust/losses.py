"""Losses of a residual that grow slower than its square: what a sample that is far off may pull.

With ``z`` the residual over its sigma, a loss rho(z) is minimised by weighing squares with ``rho'(z) / z``
again and again [Huber1964, Holland1977]. Each loses 5 % of the information of noise that is Gaussian.
"""

from __future__ import annotations

from collections.abc import Callable

_HUBER, _CAUCHY = 1.345, 2.385  # sigmas from which on a sample counts less; 95 % efficiency

Loss = Callable[[float], float]
"""Takes the square of a residual over its variance, gives the weight of that square, in (0, 1]."""


def huber(square: float) -> float:
    """Quadratic near zero, linear beyond: convex, so that there is one minimum."""
    return 1.0 if square <= _HUBER * _HUBER else float(_HUBER / square**0.5)


def cauchy(square: float) -> float:
    """Logarithmic far off: outliers pull less and less, but what is found depends on the start."""
    return 1.0 / (1.0 + square / (_CAUCHY * _CAUCHY))


LOSSES: dict[str, Loss] = {"huber": huber, "cauchy": cauchy}
