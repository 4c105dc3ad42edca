"""The guard's limits from the description of an arm.

The largest deceleration that one axis is planned with at an end of its range, ``a``, is what a share ``s`` of
the torque limit ``tau_max`` gives its inertia; less where the weight leaves less than that and a quarter, and
where twice the strain of a steady ``a`` would be beyond the limit of a gauge. A stop elsewhere is planned
with ``a_s``, such that reaction costs half its way at a quarter of the velocity limit, and that all axes may
brake at once. All this at home, at the named poses and with an axis at an end of its range, whatever is
least (of ``E`` most); gauges and friction at home alone::

    a = min(s tau_max, (tau_max - |h|) / 1.25) / M_ii      a <= eps_max / 2 |d eps / d theta''|
    b = a t / 2     t = 7 T + (1 + s) tau_max / (d tau / d t)     a <= v_max / t
    a_s = min(a, v_max / (16 t_s))     t_s = 4 T + (1 + s) tau_max / (2 d tau / d t)
    |h_i| + sum_j |M_ij| a_s,j <= tau_max,i     less for all j with much of the sum, where it is more
    E = k (v' |M| v / 2 + (|h| v + v' D v) 250 ms)       v: velocity limits
    noise = k_q sigma + 250 ms v_offset                  sigma: of the axis' encoder

``b`` covers the time until braking acts, and its taper. ``E``: an arm within its velocity limits takes no
more than it needs to reach them all from rest, to rise as fast as it can and to overcome its friction; ``k``
allows for a payload and for what the links store.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.axis_label import AxisLabel
from flexarm_controller.guarding.checks import USTRAIN
from flexarm_controller.guarding.hold_rate import HoldRate, largest_hold_rate
from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.guarding.limits import Braking, GuardLimits
from flexarm_controller.guarding.loads import Loads
from flexarm_controller.guarding.pose_loads import loads_of
from flexarm_controller.guarding.rest_watch import REST_TIME
from flexarm_controller.guarding.settings import GuardSettings
from flexarm_controller.guarding.strain_gauges import GaugeChannel, StrainGauges
from flexarm_controller.limits import Limits, limits_of
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.settings.units import axis_dimension, si_unit
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SILENT = 3.0  # periods of a slow arm that controller or drives may be silent at least: one may be lost
NOTICING = 3.0  # periods until a speed that is too high has been measured and judged
LEAD = 2.0  # periods from a measurement to the middle of the period with the torque that answers it
TAPER = 4.0  # periods in which braking takes away the rest of a velocity
HEADROOM = 1.25  # torque left by the weight over torque of the deceleration
NOTICED = 2.0  # periods by which the drives' velocity is late
FAST = 0.25  # of the velocity limit: from there on a stop keeps its way
COUPLED = 0.05  # of the torque left by the weight: an axis that asks more of another's motor gives way
OVERSHOOT = 2.0  # largest strain over steady strain when a deceleration begins at once


def guard_limits(config: ManipulatorConfig, tree: ReducedTree, settings: GuardSettings) -> GuardLimits:
    """Return what the guard enforces on an arm.

    Args:
        config: The description; its limits and its rate are those of the motors.
        tree: Its dynamics.
        settings: Of the guard.

    Raises:
        ConfigError: A motor cannot hold the weight of the arm everywhere in its range: nothing can stop it;
            or a gauge is beyond its limit where the arm rests at home: it could never be armed.
    """
    dt = round(1e9 / config.rate_hz) * 1e-9
    home, limits = linearize(tree), limits_of(config)
    ramp = (1.0 + settings.braking_share) * limits.effort / limits.effort_rate
    reaction = (NOTICING + TAPER) * dt + ramp
    loads = loads_everywhere(tree, home, limits)
    own = _deceleration(home, loads, limits, settings.braking_share)
    a = np.minimum(own, limits.velocity / reaction)
    _refuse_weak(config, a)
    _refuse_strained(config, home, settings.strain_margin * limits.strain)
    noticed = LEAD * dt + NOTICED * dt + ramp / 2.0
    alone = np.minimum(a, FAST * limits.velocity / (4.0 * noticed))
    stopping = all_at_once(alone, loads, limits.effort)
    ends = zip(limits.position_low, limits.position_high, a, a * reaction / 2.0, strict=True)
    return GuardLimits(
        effort=_row(limits.effort),
        effort_rate=_row(limits.effort_rate),
        braking=Braking(
            deceleration=_row(stopping),
            peak=_row(settings.braking_reserve * a),
            taper=1.0 / (TAPER * dt),
            rate=settings.braking_gain * largest_hold_rate(home, dt, settings.velocity_smoothing),
            lead=LEAD * dt,
        ),
        loads=loads[0],
        period=dt,
        max_age=max(settings.max_age, SILENT * dt),
        arming_time=settings.arming_time,
        rest_velocity=settings.rest_velocity,
        ranges=tuple(JointRange(*map(float, end)) for end in ends),
        velocity=_row(settings.velocity_margin * limits.velocity),
        strain=_row(settings.strain_margin * limits.strain),
        energy=settings.energy_margin * _energy(home, loads, limits),
        noise=_row(settings.position_noise * _encoder_sigma(config) + settings.velocity_offset * REST_TIME),
        velocity_delay=max(settings.velocity_delay, NOTICED * dt),
        changeover=settings.changeover,
        labels=tuple(_labels(config)),
        gauges=tuple(name.rpartition(".")[0] for name in limits.gauges),
    )


def loads_everywhere(tree: ReducedTree, home: ReducedModel, limits: Limits) -> list[Loads]:
    """Return the loads at home, at the named poses and at the ends of the ranges, those at home first."""
    named = list(_loads(tree, tree.config.poses.values()))
    return [loads_of(tree, home), *named, *_loads(tree, _ends(home, limits))]


def hold_of(limits: GuardLimits, settings: GuardSettings) -> HoldRate:
    """Return the rate that an arm of some limits is held with, at home and elsewhere."""
    return HoldRate(limits.period, settings.braking_gain, limits.braking.rate, settings.velocity_smoothing)


def gauges_of(config: ManipulatorConfig) -> StrainGauges:
    """Return who gathers what the gauges of an arm say, in the order of the limits of their strain."""
    gauges = [spec for spec in config.sensors if spec.kind == "strain_gauge"]
    return StrainGauges([GaugeChannel(s.name, s.output, s.limit) for s in gauges for _ in s.channels])


def _refuse_weak(config: ManipulatorConfig, a: Array) -> None:
    for (name, axis), left in zip(config.actuated.items(), a, strict=True):
        if not left > 0.0:
            raise ConfigError(
                f"{config.name}: {name}: effort {axis.effort:g}: the motor cannot hold the weight of the arm "
                "everywhere between the ends of the ranges, so nothing could stop it; a stronger motor or "
                "nearer ends are needed"
            )


def _refuse_strained(config: ManipulatorConfig, home: ReducedModel, most: Array) -> None:
    for name, limit in zip(limits_of(config).gauges, most, strict=True):
        rests = abs(float(home.outputs.y0[home.outputs.names.index(name)]))
        if rests > limit:
            gauge, at = name.rpartition(".")[0], f"{USTRAIN * rests:.4g} ustrain"
            raise ConfigError(
                f"{config.name}: sensors.{gauge}.limit: the guard stops above {USTRAIN * limit:.4g} ustrain, "
                f"the weight strains it by {at} at home: it cannot be armed; raise the limit or move home"
            )


def _labels(config: ManipulatorConfig) -> Iterator[AxisLabel]:
    """Give what messages call the actuated axes."""
    for i, (name, axis) in enumerate(config.actuated.items()):
        yield AxisLabel(f"axis {i + 1} ({name})", si_unit(axis_dimension(axis.name, "position")))


def all_at_once(a: Array, loads: Iterable[Loads], effort: Array) -> Array:
    """Return decelerations that all axes may brake with at once [rad/s^2] or [m/s^2], (n_theta,).

    Where they ask too much of a motor, those that ask much of it are made smaller by the same factor.

    Args:
        a: Of every axis alone, (n_theta,).
        loads: Of the poses at which they are to be kept; where holding takes all torque they cannot be.
        effort: Torque limits [N m] or [N], (n_theta,).
    """
    for known in loads:
        spare = effort - abs(np.array(known.holding))
        for row, left in zip(abs(np.array(known.inertia)), spare, strict=True):
            asked = row * a
            much = asked > COUPLED * left
            if asked.sum() > left > 0.0:
                a = np.where(much, a * (left - asked[~much].sum()) / asked[much].sum(), a)
    return a


def _deceleration(home: ReducedModel, loads: Sequence[Loads], limits: Limits, share: float) -> Array:
    """Return what braking gives an axis wherever it is [rad/s^2] or [m/s^2], (n_theta,)."""
    m = home.n_theta
    gauges = [home.outputs.names.index(name) for name in limits.gauges]
    bending = home.outputs.C_pos[gauges, m:] @ build_equilibrium(home).X[m : home.n, 2 * m :]
    with np.errstate(divide="ignore"):
        unstrained = limits.strain[:, None] / (OVERSHOOT * abs(bending))  # (n_gauges, n_theta)
    found = [*unstrained]
    for known in loads:
        left = (limits.effort - abs(np.array(known.holding))) / HEADROOM
        found.append(np.minimum(share * limits.effort, left) / np.diag(known.inertia))
    return np.asarray(np.min(found, axis=0))


def _encoder_sigma(config: ManipulatorConfig) -> Array:
    """Return the noise of the axes' encoders [rad] or [m], (n_theta,); 0 where none is described."""
    sigma = {spec.site: spec.sigma.item(0) for spec in config.sensors if spec.kind == "encoder"}
    return np.array([sigma.get(name, 0.0) for name in config.actuated])


def _ends(home: ReducedModel, limits: Limits) -> Iterator[Array]:
    """Give the poses with one axis at an end of its range, the others at home."""
    for axis in range(home.n_theta):
        for end in (limits.position_low[axis], limits.position_high[axis]):
            pose = home.pose.copy()
            pose[axis] = end
            yield pose


def _loads(tree: ReducedTree, poses: Iterable[Array]) -> Iterator[Loads]:
    """Give the loads at poses, as far as the arm can be there."""
    for pose in poses:
        try:
            yield loads_of(tree, linearize(tree, pose))
        except (PoseError, ClosureError):  # another axis ends the motion before
            continue


def _energy(home: ReducedModel, loads: Sequence[Loads], limits: Limits) -> float:
    """Return the energy that an arm within its velocity limits takes in 250 ms at most [J]; inf without."""
    m, v = home.n_theta, limits.velocity
    if not np.isfinite(v).all():
        return float("inf")  # the products would be 0 inf where nothing is coupled or nothing weighs
    rubbed = v @ np.diag(np.diag(home.D)[:m]) @ v
    return max(
        float(v @ abs(np.array(known.inertia)) @ v / 2.0)
        + GuardLimits.energy_window * float(abs(np.array(known.holding)) @ v + rubbed)
        for known in loads
    )


def _row(values: Array) -> tuple[float, ...]:
    return tuple(map(float, values))
