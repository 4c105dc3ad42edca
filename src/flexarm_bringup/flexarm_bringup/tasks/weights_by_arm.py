"""Weights of the predictive law for an arm that nobody has tuned, from its slowest mode at home.

The defaults of ``MpcConfig`` were chosen for an arm whose slowest mode has 5.2 Hz. For one that is s times as
fast, the same deviations cost the same in its own time: velocities go with s, accelerations with s^2, the
cut-off with s. The rate of torque goes with s^3, too, but with s at most: noise of sensors and modes that
nobody serves get no slower because the arm is faster, and above the modes the law has to leave both alone.
So such a law is slower in the arm's own time, and axes may be off by more, by sqrt(s): held as firmly as
those of the slower arm they shake it where it is heavier than described.

Modes of an arm may be out at the tip by a share of what axes off by ``position_error`` make there,
``k (share L position_error)^2 / 2``; k is the stiffness of the softest mode at the tip, L the longest lever
of an axis, and the share that of the same arm. The horizon is half a period of the slowest mode at least.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flexarm_bringup.retune.arm_facts import ArmFacts, read_facts
from flexarm_bringup.retune.horizon import LEAST, MOST, spread_blocks
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.tip_moves import are_felt

CHOSEN_FOR_HZ = 5.2  # slowest mode of the arm that the defaults were chosen for
TIP_SHARE = 0.22  # there: 1.3 mm in the mode cost as much as axes off by 9.2 mrad, which are 5.9 mm at 0.64 m


def weights_for(model: ReducedModel, dt: float) -> dict[str, Any]:
    """Return settings of the predictive law by name, two digits of each; none for an arm without modes.

    Args:
        model: The arm at home.
        dt: Control period [s].
    """
    if not model.n_eta:
        return {}
    facts, chosen = read_facts(model), MpcConfig()
    s = float(facts.f_hz[0]) / CHOSEN_FOR_HZ
    position_error = chosen.position_error * math.sqrt(max(s, 1.0))
    weights = {
        "position_error": position_error,
        "velocity_error": chosen.velocity_error * s,
        "input_acceleration": chosen.input_acceleration * s**2,
        "input_jerk": chosen.input_jerk * min(s, s**3),
        "modal_cutoff_hz": chosen.modal_cutoff_hz * s,
        **_energy(model, facts, position_error),
    }
    told = {name: float(f"{value:.2g}") for name, value in weights.items()}
    return {**told, **_horizon(float(facts.f_hz[0]), dt, chosen)}


def _energy(model: ReducedModel, facts: ArmFacts, position_error: float) -> dict[str, float]:
    """Return the energy that costs 1 [J]; nothing where the tip feels no served mode, or no axis moves it."""
    out = model.outputs
    places = [row for row in out.rows("tip") if out.units[row] == "m"]
    lever = float(np.linalg.norm(out.C_pos[places, : model.n_theta], axis=0).max(initial=0.0))
    if not (lever and are_felt(model)):
        return {}
    softest = float(facts.tip_stiffness.min())
    return {"modal_energy": softest * (TIP_SHARE * lever * position_error) ** 2 / 2}


def _horizon(slowest_hz: float, dt: float, chosen: MpcConfig) -> dict[str, Any]:
    """Return horizon and blocks where the default is shorter than half a period of the slowest mode."""
    wanted = min(math.ceil(LEAST / (slowest_hz * dt)), int(MOST))
    if wanted <= chosen.horizon:
        return {}
    return {"horizon": wanted, "blocks": list(spread_blocks(chosen.blocks, wanted))}
