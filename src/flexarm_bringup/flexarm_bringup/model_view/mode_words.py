"""Mode shapes in words: what stores the energy, and where the tip goes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.energy_shares import EnergyShares
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.tip_moves import tip_moves, tip_turns

Array = NDArray[np.float64]

WORTH_NAMING = 0.05  # share of the energy
NAMED = 3  # contributions
DIRECTION = 0.35  # of the length of the tip's displacement; smaller components are not named
STILL = 1e-3  # tip displacement over the largest of all modes
AXES = "xyz"


def describe_mode(model: ReducedModel, shares: EnergyShares, mode: int) -> str:
    """Return one line on a mode, numbered from 0."""
    return f"{describe_energy(shares, mode)}; {describe_tip(model, mode)}"


def describe_energy(shares: EnergyShares, mode: int) -> str:
    """Return who stores the strain energy: "strip bends along y 100 %"."""
    named = shares.largest(mode, WORTH_NAMING)
    parts = [f"{name} {100 * share:.0f} %" for name, share in named[:NAMED]]
    left = [share for _, share in named[NAMED:]]
    if left:
        parts.append(f"{len(left)} other{'s' * (len(left) > 1)} {100 * sum(left):.0f} %")
    return ", ".join(parts)


def describe_tip(model: ReducedModel, mode: int) -> str:
    """Return where the tip goes, in its own axes, per unit of the mass-normalised coordinate."""
    rows = model.outputs.rows("tip")
    moves = model.outputs.C_pos[rows][:, model.n_theta :]  # (6, r)
    lengths, turns = tip_moves(model), tip_turns(model)  # 0 where rounding alone moves or turns it
    if lengths[mode] > STILL * lengths.max():
        return f"tip moves along {direction(moves[:3, mode])}, {lengths[mode]:.3g} /√kg"
    if turns[mode] > STILL * turns.max():
        return f"tip turns about {direction(moves[3:, mode])}, {turns[mode]:.3g} rad/(m √kg)"
    return "tip stands still"


def direction(vector: Array) -> str:
    """Return the axes that a displacement (3,) lies along, the largest first: "y", "x and -z"."""
    size = abs(vector)
    order = [i for i in np.argsort(-size, kind="stable") if size[i] >= DIRECTION * np.linalg.norm(vector)]
    sign = np.sign(vector[order[0]])
    return " and ".join(("-" if sign * vector[i] < 0 else "") + AXES[i] for i in order)
