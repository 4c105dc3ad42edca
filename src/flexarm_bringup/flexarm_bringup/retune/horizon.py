"""Rule for the horizon: as much of the slowest mode's period as before, and never less than half of it.

The blocks stay as many, so that a step takes as long as before; the later ones become longer or shorter.
Short motions are those of as many periods as before.
"""

from __future__ import annotations

import math
from dataclasses import fields, replace

from flexarm_bringup.retune.arm_facts import ArmFacts
from flexarm_controller.settings import MpcConfig

LEAST = 0.5  # of the period of the slowest mode
MOST = next(item.metadata["maximum"] for item in fields(MpcConfig) if item.name == "horizon")

LONGEST_FIRM = next(item.metadata["maximum"] for item in fields(MpcConfig) if item.name == "firm_time")


def fit_horizon(mpc: MpcConfig, before: ArmFacts, after: ArmFacts, dt: float) -> MpcConfig:
    """Return the settings with horizon and blocks for the arm as it is; ``dt`` is the control period [s]."""
    same_share = mpc.horizon * float(before.f_hz[0] / after.f_hz[0])
    half_period = LEAST / float(after.f_hz[0]) / dt
    horizon = min(max(math.ceil(same_share - 1e-9), math.ceil(half_period), 2), int(MOST))
    firm = min(mpc.firm_time * float(before.f_hz[0] / after.f_hz[0]), LONGEST_FIRM)
    return replace(mpc, horizon=horizon, blocks=spread_blocks(mpc.blocks, horizon), firm_time=firm)


def spread_blocks(blocks: tuple[int, ...], horizon: int) -> tuple[int, ...]:
    """Return blocks that sum up to ``horizon``: periods are added to, or taken off, the last ones in turn."""
    new = list(blocks)
    while sum(new) < horizon:
        new[_last(new, min(new[len(new) // 2 :]))] += 1
    while sum(new) > horizon:
        longest = max(new)
        if longest == 1:
            new.pop()
        else:
            new[new.index(longest)] -= 1
    return tuple(new)


def _last(blocks: list[int], size: int) -> int:
    """Return the last block of a size in the second half."""
    return max(i for i in range(len(blocks) // 2, len(blocks)) if blocks[i] == size)
