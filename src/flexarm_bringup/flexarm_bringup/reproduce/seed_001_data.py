"""What seed 001 says of its two presets: fitted values, targets, golden numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.seed_001_rig import Unknowns

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Preset:
    """What the seed says of one preset.

    Attributes:
        fitted: Section 2.
        f1_hz, f2_hz: Targets of the fit; those of the stiffnesses follow from ``heights`` and ``zeta``.
        heights: H0 of mode 2 at tool and platform [m/N], printed or reconstructed.
        zeta: Damping ratio of all modes.
        golden_hz: First ten frequencies, section 4.
        readings: Zeta, H0 [m/N] and k [N/m] at a point on the 1 Hz grid, section 6.
        peak_hz: Peak and band there, section 4.
    """

    fitted: Unknowns
    f1_hz: float
    f2_hz: float
    heights: tuple[float, float]
    zeta: float
    golden_hz: tuple[float, ...]
    readings: dict[str, tuple[float, float, float]]
    peak_hz: tuple[float, float, float]

    @property
    def targets(self) -> Array:
        """f1, f2 [Hz], modal stiffness of mode 2 at tool and platform [N/m], (4,)."""
        return np.array([self.f1_hz, self.f2_hz, *(1 / (2 * height * self.zeta) for height in self.heights)])


SEED = {
    "sim": Preset(
        Unknowns(1.66750e6, 0.613721, 1065.65, 12328.0),
        96.0,
        129.0,
        (0.045e-3, 0.032e-3),
        6 / 258,
        (96.00, 129.00, 160.01, 192.09, 205.80, 231.36, 235.59, 237.12, 308.58, 325.55),
        {"tool": (0.02326, 0.0450e-3, 4.78e5), "platform": (0.02326, 0.0320e-3, 6.72e5)},
        (129.0, 126.0, 132.0),
    ),
    "exp": Preset(
        Unknowns(2.30925e6, 0.815293, 1774.12, 31930.9),
        105.0,
        133.5,
        (0.052e-3, 0.0428e-3),
        0.0140,
        (105.00, 133.50, 171.61, 193.58, 210.88, 231.44, 236.39, 240.83, 322.27, 337.82),
        {"tool": (0.01504, 0.0505e-3, 6.59e5), "platform": (0.01504, 0.0416e-3, 8.00e5)},
        (133.0, 131.0, 135.0),
    ),
}
