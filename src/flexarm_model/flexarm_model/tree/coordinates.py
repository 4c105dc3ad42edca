"""What the coordinates of a manipulator are: axes of joints, axes of closures, elastic coordinates.

Gears count as engaged: a spring with ``backlash`` has its whole stiffness here, in its gap too, and so have
the models that follow. That is the describing function of the dead zone for loads far above the play
[Nordin2002]; the simulated rig takes away what a gap does not bear.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.tree.modal_damping import Losses

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coordinates:
    """The coordinates q of a reduced tree.

    Attributes:
        axes: By name "joint.axis"; they come first in q.
        elastic: Where each body's elastic coordinates stand in q.
        names: Of all coordinates, (n,).
    """

    axes: dict[str, Axis]
    elastic: dict[str, range]
    names: tuple[str, ...]

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.names)

    @property
    def actuated(self) -> list[int]:
        """Indices of the actuated axes."""
        return [i for i, axis in enumerate(self.axes.values()) if axis.actuated]

    @property
    def loose_axes(self) -> NDArray[np.intp]:
        """Indices of the axes with neither motor nor spring."""
        axes = enumerate(self.axes.values())
        return np.array([i for i, axis in axes if not (axis.actuated or axis.stiffness)], dtype=np.intp)

    @property
    def sprung_axes(self) -> NDArray[np.intp]:
        """Indices of the axes with a spring and no motor."""
        axes = enumerate(self.axes.values())
        return np.array([i for i, axis in axes if axis.stiffness and not axis.actuated], dtype=np.intp)


def lay_out(config: ManipulatorConfig, bodies: Mapping[str, Superelement]) -> Coordinates:
    """Return the coordinates of a manipulator with these superelements."""
    axes = config.axes
    elastic, names = {}, list(axes)
    for name, body in bodies.items():
        elastic[name] = range(len(names), len(names) + body.n)
        names += [f"{name}.{i + 1}" for i in range(body.n)]
    return Coordinates(axes, elastic, tuple(names))


def assumed_home(config: ManipulatorConfig, at: Coordinates) -> Array:
    """Return where closing the loops starts: guesses, the actuated axes at home, nothing bent, (n_q,)."""
    q = np.zeros(at.n)
    q[: len(at.axes)] = [axis.guess for axis in at.axes.values()]
    q[at.actuated] = config.home
    return q


def stiffness(at: Coordinates, bodies: Mapping[str, Superelement]) -> tuple[Array, Losses]:
    """Return the stiffness of springs and bodies, (n, n), and what its parts lose."""
    K, ratio, rate = np.zeros((at.n, at.n)), np.zeros(at.n), np.zeros(at.n)
    for i, axis in enumerate(at.axes.values()):
        K[i, i], ratio[i] = axis.stiffness, axis.damping_ratio
    for name, body in bodies.items():
        index = slice(at.elastic[name].start, at.elastic[name].stop)
        K[index, index], ratio[index], rate[index] = body.K, body.damping_ratio, body.damping_rate
    return K, Losses(ratio[:, None] * K, rate[:, None] * K)


def dampers(at: Coordinates, bodies: Mapping[str, Superelement]) -> Array:
    """Return the viscous damping of axes and bodies, (n, n)."""
    D = np.zeros((at.n, at.n))
    for i, axis in enumerate(at.axes.values()):
        D[i, i] = axis.damping
    for name, body in bodies.items():
        index = slice(at.elastic[name].start, at.elastic[name].stop)
        D[index, index] = body.D
    return D
