"""What to do about modes that have drifted.

All modes stiffer or softer by the same is the arm: modulus, temperature, or mass of a part. Modes that
changed apart point to one place: a payload, a loose bolt. That is said only of modes that are read within the
reach of the method, and some moves after the last of them was told. While a sensor is doubted none of it is,
nor of a mode without damping: no arm has one, a gauge that says too little makes one.

A description is refreshed by a modal test: the smooth moves that the watch listens to leave too few lines
coherent for one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexarm_estimator.drift.judgement import CERTAIN, ModeNow

ALIKE = 3.0  # sigmas within which changes of modes are the same
ALL_ALIKE = "as if all stiffness"
TOO_EARLY = "too early to tell whether all changed alike"
NEVER = "whether all changed alike cannot be told"
MODAL_TEST = "flexarm identify rig --nodes join --manipulator NAME [--preset PRESET]"  # of the rig that runs
REFRESH = (
    f"refresh the description by a modal test, while no controller is active: {MODAL_TEST} --update --retune"
)


def proposal(modes: Sequence[ModeNow], is_damping_alone: bool = False, is_early: bool = False) -> str:
    """Return what to do about modes of which at least one has drifted.

    Args:
        modes: Those that are judged.
        is_damping_alone: None of them has drifted in its frequency.
        is_early: A mode is told so lately that others may still be read from the time before.
    """
    if is_damping_alone:
        return (
            "damping changed and no frequency did: look for a bolt that works loose, a bearing or a cable "
            f"that rubs, or {REFRESH}"
        )
    told = [mode for mode in modes if mode.is_known]
    known = [mode for mode in told if mode.change_sigma < CERTAIN] or told
    if not known:  # it was; the arm has stood too long to tell by how much
        return REFRESH
    if _are_apart(known):
        return f"{_of_modes_apart(known, is_early)}, or {REFRESH}"
    factor = (1.0 + _mean(known)) ** 2
    return f"{ALL_ALIKE} were {factor:.3f} times (or all mass {1 / factor:.3f} times) that; {REFRESH}"


def suspicion(doubted: Mapping[str, str], undamped: Sequence[str] = ()) -> str:
    """Return what to do while it is not clear whether arm or sensor has changed.

    Args:
        doubted: What speaks against sensors, by name.
        undamped: Modes that read as if nothing damped them.
    """
    said = [f"{name}: {why}" for name, why in sorted(doubted.items())]
    said += [f"scale, sign and delay of all sensors: {denial(undamped)}"] if undamped else []
    return f"a sensor may be what changed, not the arm: look first at {'; '.join(said)}"


def denial(undamped: Sequence[str]) -> str:
    """Return what modes say that no arm does; empty without such modes."""
    names = ", ".join(sorted(undamped)).replace("_", " ")
    return f"in doubt: {names} cannot be without damping" if undamped else ""


def _of_modes_apart(known: Sequence[ModeNow], is_early: bool) -> str:
    """Return what is said, and what to do first, where known modes read as if they had changed apart."""
    is_moving = not all(mode.is_settled for mode in known)
    damped = [mode.name for mode in known if mode.is_settled and not mode.is_within_reach]
    if not is_early and _are_apart([mode for mode in known if mode.is_within_reach]):
        return "modes changed apart: look for a payload or a loose joint"
    if is_early or is_moving or not damped:
        return f"{TOO_EARLY}: look again after some moves"
    names = ", ".join(damped).replace("_", " ")
    return f"{NEVER}, for {names} reads many times as damped: look for a payload or a loose joint"


def _are_apart(modes: Sequence[ModeNow]) -> bool:
    """Return whether a mode has changed by something else than the others."""
    if len(modes) < 2:
        return False
    mean = _mean(modes)
    return max(abs(mode.drift - mean) / mode.drift_sigma for mode in modes) > ALIKE


def _mean(modes: Sequence[ModeNow]) -> float:
    weights = np.array([mode.drift_sigma**-2 for mode in modes])
    return float(weights @ np.array([mode.drift for mode in modes]) / weights.sum())
