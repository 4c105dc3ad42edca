"""References from outside: followed, slowed down, or refused, with what the arm cannot do of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from flexarm_controller.limits import Limits
from flexarm_controller.motion.arm_loads import AWAITED, MOST, ArmLoads
from flexarm_controller.motion.calm import calm
from flexarm_controller.motion.excess import Excess, find_excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.retime import RESERVE, retime
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.strains import Strains, strains_of
from flexarm_controller.motion.stretch import slow_down, stretch
from flexarm_controller.motion.told_motion import refuse_moving_end, with_own_accelerations
from flexarm_controller.motion.torques import Torques
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference
from flexarm_model.motion.conversions import LONGEST
from flexarm_model.served.reduced_model import ReducedModel

_Asked = tuple[Reference, Limits, Sequence[str], Torques, float]
SLOWED = ("torque", "strain")  # what a law may lag behind or damp; through a range's end it may not
TOLD = {"torque": "the arm will lag", "strain": "the law must bend the arm less than this would"}
HURRIED = (
    "while the guard is armed nothing is slowed down for strain that is slowed down for torque, too, or goes "
    "a way on which weight and inertia change"
)
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
        model: The served model, for its torque and the strain of its gauges.
        limits: Of the arm.
        config: What becomes of a reference that is too fast.
        is_awaited: Commands are; then nothing is slowed down that takes long, and loads are fewer.
        loads: Of the arm away from the model's pose; None: they are the model's.

    Raises:
        MotionError: It is outside the limits; names axis, quantity, value, limit and instant.
    """
    if reference.theta.shape[1] != limits.effort.size:
        raise MotionError(reference.fault(limits))
    refuse_moving_end(reference, limits, model.theta_names)
    reference, disbelief = with_own_accelerations(reference, model.theta_names)
    followed, remark = _within_limits(reference, model, limits, config, is_awaited, loads)
    return followed, "; ".join(said for said in (disbelief, remark) if said)


def _within_limits(  # noqa: PLR0913, what ``admit`` has
    reference: Reference,
    model: ReducedModel,
    limits: Limits,
    config: MotionConfig,
    is_awaited: bool,
    loads: ArmLoads | None,
) -> tuple[Reference, str]:
    """Return what ``admit`` does of a reference that does not contradict itself."""
    way = loads.along(reference, model.pose, AWAITED if is_awaited else MOST) if loads else None
    checks = _Checks(
        limits,
        model.theta_names,
        build_equilibrium(model) if way is None else way.rows(np.ones(model.n_theta)),
        strains_of(model, limits, way),
        is_calmed=way is None or not is_awaited,
        is_calmed_after=not is_awaited,
    )
    excess = checks.find(reference)
    if excess is None:
        return reference, ""
    is_slowed = config.excess == "stretch" or (config.excess == "retime" and excess.quantity in SLOWED)
    most = MOST_SLOWED // reference.theta.shape[1]
    if is_slowed and is_awaited and reference.t.size > most:
        raise MotionError(
            f"{excess}; while the guard is armed it is slowed down where it has at most {most} "
            f"points, this one has {reference.t.size}"
        )
    if is_slowed:
        return _slowed(reference, excess, checks, config)
    if excess.quantity in SLOWED and config.excess == "tell":
        return reference, f"{TOLD[excess.quantity]}: {excess}"
    raise MotionError(str(excess))


@dataclass(frozen=True)
class _Checks:
    """What trajectories are held against.

    Attributes:
        limits: Of the arm.
        names: Of the axes, "joint.axis".
        equilibrium: Torque that goes with a motion.
        strains: That go with it.
        is_calmed: Whether there is time to slow one down for its strain alone.
        is_calmed_after: Whether there is after it was slowed down for torque: it has more points then.
    """

    limits: Limits
    names: Sequence[str]
    equilibrium: Torques
    strains: Strains | None
    is_calmed: bool
    is_calmed_after: bool

    def find(self, reference: Reference) -> Excess | None:
        """Return the worst of the first quantity beyond a limit."""
        return find_excess(reference, self.limits, self.names, self.equilibrium, self.strains)

    def calmed(self, reference: Reference, config: MotionConfig, spent: float) -> tuple[Reference, float]:
        """Return it slowed down for its strain, and by how much [1]; ``spent`` is what it was before."""
        try:
            gentle = partial(self._find_soonest, config.motion_strain)
            return calm(reference, gentle, config.excess_slowdown, spent)
        except MotionError:
            return calm(reference, partial(self._find_soonest, 1.0), config.excess_slowdown, spent)

    def _find_soonest(self, share: float, reference: Reference) -> Excess | None:
        """Return the worst strain beyond a share of its limit, which is likeliest, else as ``find``."""
        strains = self.strains and replace(self.strains, limit=share * self.strains.limit)
        strain = find_excess(reference, self.limits, self.names, None, strains)
        return strain or find_excess(reference, self.limits, self.names, self.equilibrium)


def _slowed(
    reference: Reference, excess: Excess, checks: _Checks, config: MotionConfig
) -> tuple[Reference, str]:
    """Return it slowed down, for torque first, then as a whole for the strain that is left; and a remark.

    As no law follows to the instant, vibration of two ramps adds up otherwise than in the reference: slowed
    down, it is within the share that planned motions may have, if that can be.
    """
    slowed, said, is_calmed = reference, list[str](), checks.is_calmed
    if excess.quantity != "strain":
        asked = (reference, checks.limits, checks.names, checks.equilibrium, config.excess_slowdown)
        slowed, remark = _stretched(asked, excess) if config.excess == "stretch" else _retimed(asked, excess)
        said, is_calmed = [remark], checks.is_calmed and checks.is_calmed_after
    if (strain := checks.find(slowed)) is not None:
        if reference.t.size == 1:
            raise MotionError(f"slowing down does not help: {strain}")
        if not is_calmed:
            raise MotionError(f"{strain}; {HURRIED}")
        spent = float((slowed.t[-1] - slowed.t[0]) / (reference.t[-1] - reference.t[0]))
        slowed, factor = checks.calmed(slowed, config, spent)
        said.append(f"stretched in time by {factor:.4g}: {strain}")
    return slowed, "; ".join(said)


def _stretched(asked: _Asked, excess: Excess) -> tuple[Reference, str]:
    slowed, factor = stretch(*asked)
    return slowed, f"stretched in time by {factor:.4g}: {excess}"


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
