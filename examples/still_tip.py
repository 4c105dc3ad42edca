"""The shortest way through the library: describe, reduce, serve, control, compare.

Run it with ``python examples/still_tip.py`` in ``./flexarm shell``.
"""

from __future__ import annotations

import numpy as np

from flexarm_bringup.closed_loop import LoopSettings, run_closed_loop
from flexarm_bringup.demo_run.motions import motions, out_and_back
from flexarm_bringup.record import judge
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

REACH = 0.64  # distance of the tip from the axis [m]


def main(angle_deg: float = 10.0) -> dict[str, float]:
    """Turn the single link and return its first frequency [Hz] and what is left at the tip."""
    config = load_config(find_manipulator("single_link"), preset="geared")
    model = linearize(ReducedTree(config))
    moves = out_and_back([np.radians(angle_deg)], "A", "ZVD", motions(zeta=0.015))
    figures = judge(run_closed_loop(config, moves, LoopSettings()), moves[0], REACH)
    return {
        "first_frequency_hz": float(model.omega[0] / (2 * np.pi)),
        "residual_m_s2": figures.residual,
        "settling_s": figures.settling,
    }


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:20} {value:.4f}")
