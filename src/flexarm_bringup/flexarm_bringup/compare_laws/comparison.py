"""What a moves file says about ``flexarm compare``: section ``compare``, all of it optional.

::

    compare:
      moves: {...}                # instead of those that "flexarm sim" does
      signal: accelerometer       # what is judged: the tip, or accelerometers less what a rigid arm feels
      shaped: three-hump EI       # what MPC is given beside; else the most robust one by the served model
      worst_db: -31               # bounds; without one the row is printed and not judged
      shaped_db: -34
      scarce_gain_db: 10
      slowest: 1.2
      other_presets_db: {light_hub: -28}
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from flexarm_bringup.tasks.task_moves import TaskMove, read_move
from flexarm_model.settings.strict_yaml import Section

SIGNALS = ("tip", "accelerometer")


@dataclass(frozen=True)
class Comparison:
    """How laws are compared on an arm.

    Attributes:
        moves: What it does; empty for the moves of the task.
        signal: "tip": its acceleration; "accelerometer": theirs less a rigid arm's.
        shaped: Motion that MPC is given beside the worst one; empty: the most robust by the served model.
        worst_db: MPC on the worst profile, at most [dB]; None for no bound.
        shaped_db: MPC on a shaped reference, at most [dB].
        scarce_gain_db: What MPC gains on the clipped LQR at half the torque beyond the weight, at least [dB].
        slowest: Shortest time in which MPC arrives over the time-optimal bound, at most [1].
        other_presets_db: MPC at +-10 % frequency under other presets, at most [dB].
    """

    moves: Mapping[str, TaskMove] = field(default_factory=dict)
    signal: str = "tip"
    shaped: str = ""
    worst_db: float | None = None
    shaped_db: float | None = None
    scarce_gain_db: float | None = None
    slowest: float | None = None
    other_presets_db: Mapping[str, float] = field(default_factory=dict)


def read_comparison(section: Section) -> Comparison:
    """Read the section.

    Raises:
        ConfigError: Anything is wrong with it.
    """
    others = section.section("other_presets_db", {})
    comparison = Comparison(
        moves={name: read_move(move) for name, move in section.sections("moves", {})},
        signal=section.choice("signal", SIGNALS, "tip"),
        shaped=section.text("shaped", ""),
        worst_db=_bound(section, "worst_db"),
        shaped_db=_bound(section, "shaped_db"),
        scarce_gain_db=_bound(section, "scarce_gain_db"),
        slowest=_bound(section, "slowest"),
        other_presets_db={name: others.quantity(name, "ratio") for name in others.names()},
    )
    section.done()
    return comparison


def _bound(section: Section, key: str) -> float | None:
    return section.quantity(key, "ratio") if section.has(key) else None
