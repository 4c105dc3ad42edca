"""Identified modes that are perhaps faster ones of the arm, which its sampling rate shows in the band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.seen_shapes import find_channels, real_shapes
from flexarm_model.bodies.model_order import with_more_modes
from flexarm_model.identification.described_arm import ArmModes, arm_modes
from flexarm_model.identification.described_shapes import in_size, seen_at
from flexarm_model.identification.mirrored_modes import ToldModes, find_mirrored, mirror
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.fit import PoleFit
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
MORE_MODES = 3  # per body than the description keeps, as for the margins


@dataclass(frozen=True)
class Mirrored:
    """A described mode above half the rate.

    Attributes:
        f_hz: Its frequency [Hz].
        rate_hz: Of the samples [Hz].
    """

    f_hz: float
    rate_hz: float

    @property
    def seen_hz(self) -> float:
        """Where the samples show it [Hz]."""
        return float(mirror(np.array([self.f_hz]), self.rate_hz)[0])


@dataclass(frozen=True)
class Sampled:
    """How an arm was sampled.

    Attributes:
        config: Its description.
        pose: Actuated axes [rad or m], (n_theta,); None is home.
        motors_locked: They were held by brakes.
        rate_hz: Samples per second [Hz].
        outputs: Names of the measured outputs; empty where the residues are not of outputs by inputs.
    """

    config: ManipulatorConfig
    pose: Array | None
    motors_locked: bool
    rate_hz: float
    outputs: tuple[str, ...]


def mirrored_modes(fit: PoleFit, sampled: Sampled) -> tuple[Mirrored | None, ...]:
    """Return per identified mode the described one above half the rate that it perhaps is; None: it is none.

    Raises:
        PoseError, ClosureError: There is no model at the pose.
    """
    tree = ReducedTree(with_more_modes(sampled.config, MORE_MODES), use_compiler=False)
    modes = arm_modes(tree, sampled.pose, sampled.motors_locked)
    f_hz = modes.omega / (2 * np.pi)
    found, described = _shapes(fit, modes, f_hz < sampled.rate_hz / 2, sampled)
    which = find_mirrored(
        ToldModes(fit.model.f_hz, fit.model.zeta, found),
        ToldModes(f_hz, modes.zeta, described),
        sampled.rate_hz,
    )
    return tuple(Mirrored(float(f_hz[i]), sampled.rate_hz) if i >= 0 else None for i in which)


def without_mirrored(fit: PoleFit | None, others: Sequence[object | None]) -> PoleFit | None:
    """Return the modes that the arm has where they were found; None where there are none.

    Args:
        fit: All poles.
        others: What each is instead; None where it is a mode.
    """
    own = np.array([other is None for other in others], bool)
    if fit is None or not own.any():
        return None
    model = replace(fit.model, poles=fit.model.poles[own], residues=fit.model.residues[own])
    return replace(
        fit,
        model=model,
        f_std_hz=fit.f_std_hz[own],
        zeta_std=fit.zeta_std[own],
        lines_per_bandwidth=fit.lines_per_bandwidth[own],
        at_bound=fit.at_bound[own],
    )


def _shapes(
    fit: PoleFit, modes: ArmModes, is_slow: NDArray[np.bool_], sampled: Sampled
) -> tuple[Array, Array]:
    """Return identified and described shapes at the channels that both have, in units of the slow modes'."""
    columns, names = find_channels(sampled.config, sampled.outputs)
    if not names:
        return np.zeros((len(fit.model.poles), 0)), np.zeros((modes.omega.size, 0))
    described = seen_at(modes, names)
    slow = described[is_slow] if is_slow.any() else described
    size = np.maximum(abs(slow).max(axis=0, initial=0.0), np.finfo(float).tiny)
    return in_size(real_shapes(fit)[:, list(columns)], size), in_size(described, size)
