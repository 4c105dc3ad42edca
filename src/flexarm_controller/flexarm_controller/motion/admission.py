"""References from outside: followed, slowed down, or refused, with what the arm cannot do of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from flexarm_controller.limits import Limits
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.motion.excess import Excess, find_excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.retime import RESERVE, retime
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.stretch import slow_down, stretch
from flexarm_controller.motion.torques import Torques
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference
from flexarm_model.motion.conversions import LONGEST
from flexarm_model.served.reduced_model import ReducedModel

_Asked = tuple[Reference, Limits, Sequence[str], Torques, float]
WITH_RESERVE = RESERVE**-0.5  # torque of accelerations goes with the square of time
MUCH = 1.1  # times the time; what is asked for keeps its own timing where it can
MOST_SLOWED = (
    100  # points times axes of what is slowed down while commands are awaited: 0.35 ms each at worst
)


def admit(
    reference: Reference,
    model: ReducedModel,
    limits: Limits,
    config: MotionConfig,
    is_awaited: bool = False,
    loads: ArmLoads | None = None,
) -> tuple[Reference, str]:
    """Return what is to be followed, and a remark where that is not simply the reference.

    Args:
        reference: Asked for.
        model: The served model, for its torque.
        limits: Of the arm.
        config: What becomes of a reference that is too fast.
        is_awaited: Commands are; then nothing is slowed down that takes long.
        loads: Of the arm away from the model's pose; None: they are the model's.

    Raises:
        MotionError: It is outside the limits; names axis, quantity, value, limit and instant.
    """
    if reference.theta.shape[1] != limits.effort.size:
        raise MotionError(reference.fault(limits))
    way = loads.along(reference, model.pose) if loads else None
    equilibrium = build_equilibrium(model) if way is None else way.rows(np.ones(model.n_theta))
    names = model.theta_names
    excess = find_excess(reference, limits, names, equilibrium)
    if excess is None:
        return reference, ""
    is_slowed = config.excess == "stretch" or (config.excess == "retime" and excess.quantity == "torque")
    most = MOST_SLOWED // reference.theta.shape[1]
    if is_slowed and is_awaited and reference.t.size > most:
        raise MotionError(
            f"{excess}; while the guard is armed it is slowed down where it has at most {most} "
            f"points, this one has {reference.t.size}"
        )
    asked = (reference, limits, names, equilibrium, config.excess_slowdown)
    if config.excess == "stretch":
        slowed, factor = stretch(*asked)
        return slowed, f"stretched in time by {factor:.4g}: {excess}"
    if excess.quantity == "torque" and config.excess == "retime":
        return _retimed(asked, excess)
    if excess.quantity == "torque" and config.excess == "tell":
        return reference, f"the arm will lag: {excess}"
    raise MotionError(str(excess))


def _retimed(asked: _Asked, excess: Excess) -> tuple[Reference, str]:
    """Return it slowed down where torque is short, or as a whole where that ends much sooner; and a remark.

    As a whole it is slowed down so far that the same share of the torque is left for feedback.
    """
    slowed, stretched = _tried(retime, asked), _tried(stretch, asked)
    if isinstance(slowed, MotionError):
        if isinstance(stretched, MotionError):
            raise slowed
        why, (whole, factor) = "does not suffice", stretched
    else:
        kept = slowed[0], f"slowed down where torque is short, ends {slowed[1]:.3f} s later: {excess}"
        if isinstance(stretched, MotionError):
            return kept
        why, factor = "takes longer", stretched[1] * WITH_RESERVE
        whole = slow_down(stretched[0], WITH_RESERVE)
        if slowed[0].t[-1] - whole.t[0] <= MUCH * (whole.t[-1] - whole.t[0]):
            return kept
    return whole, (
        f"stretched in time by {factor:.4g}, as slowing down only where torque is short {why}: {excess}"
    )


def _tried(
    slow: Callable[..., tuple[Reference, float]], asked: _Asked
) -> tuple[Reference, float] | MotionError:
    """Return what slowing down leads to, or why it leads nowhere."""
    try:
        return slow(*asked)
    except MotionError as error:
        return error


def check_begin(after: float, late: float) -> None:
    """Check when a reference begins.

    Args:
        after: So long after the newest state [s].
        late: How long before it may have begun [s].

    Raises:
        MotionError: Too long ago, or so late that its stamp is of another clock.
    """
    if after < -late:
        raise MotionError(
            f"it begins {-after:.3g} s before the newest state, {late:g} s are allowed: "
            "stamp it with the time at which it is to begin (a stamp of zero does not mean now)"
        )
    if after > LONGEST:
        raise MotionError(f"it begins {after:.3g} s after the newest state, {LONGEST} s are allowed")
