"""Shear coefficients of sections: the share kappa of the area that bears a shear force evenly [Cowper1966].

They follow from the elasticity of a plain material. Of one with fibres the ratio E / 2 G - 1 is no Poisson's
ratio; the nearest that there is stands for it then, 0 or 1/2.
"""

from __future__ import annotations


def poissons_ratio(E: float, G: float) -> float:
    """Return Poisson's ratio of a plain material of moduli E and G [Pa], within [0, 1/2]."""
    return min(max(E / (2 * G) - 1, 0.0), 0.5)


def of_rectangle(nu: float) -> float:
    """Return kappa of a rectangle along either side."""
    return 10 * (1 + nu) / (12 + 11 * nu)


def of_tube(nu: float, bore: float) -> float:
    """Return kappa of a round tube whose inner diameter is ``bore`` of the outer one; 0 is a rod."""
    a, b = (1 + bore**2) ** 2, bore**2
    return 6 * (1 + nu) * a / ((7 + 6 * nu) * a + (20 + 12 * nu) * b)


def of_box(nu: float, along: float, across: float) -> float:
    """Return kappa of a thin-walled box sheared along one side; both [m] from mid-wall to mid-wall."""
    m = across / along
    webs = 12 + 72 * m + 150 * m**2 + 90 * m**3 + nu * (11 + 66 * m + 135 * m**2 + 90 * m**3)
    return 10 * (1 + nu) * (1 + 3 * m) ** 2 / (webs + 10 * m**2 * ((3 + nu) * m + 3 * m**2))
