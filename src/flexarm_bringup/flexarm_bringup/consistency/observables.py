"""What of a state can be compared with the truth without ambiguity, and its exact Jacobian.

Modes are a matter of convention and of how many there are; where the axes are, where the tip is and what a
gauge feels is not::

    z(x) = [theta; tip position; tip rotation; strain]        S = H P H',  H = dz/dx

The tip's Jacobian is the exact one at the estimate; strains are rows of the served
model, and what a share of the sag tells a gauge beyond its modes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.consistency.nees import Square, normalised_square
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.sag import sag_states
from flexarm_estimator.tool.rotation_log import log_rotation
from flexarm_estimator.tool.tip import Kinematics, PlainTip
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
KINDS = ("axes", "tip", "strain")


class TrueArm(NamedTuple):
    """The truth at one instant.

    Attributes:
        theta: Actuated axes [rad] or [m], (n_theta,).
        T_world_tip: Pose of the tip, (4, 4).
        strain: At the gauges [1], (n_gauges,).
    """

    theta: Array
    T_world_tip: Array
    strain: Array


class Deviation(NamedTuple):
    """How far an estimate is off.

    Attributes:
        e: Truth minus estimate, (m,).
        S: Covariance that the estimate claims for it, (m, m).
        parts: Where axes, position, rotation and strain stand.
    """

    e: Array
    S: Array
    parts: tuple[slice, slice, slice, slice]

    def square(self) -> Square:
        """Return the normalised square of everything together."""
        return normalised_square(self.e, self.S, self.parts)

    def squares(self) -> dict[str, Square]:
        """Return those of axes, tip pose and strain by themselves."""
        axes, position, rotation, strain = self.parts
        split = position.stop - position.start
        inner = (slice(0, split), slice(split, None))
        groups = {"axes": axes, "tip": slice(position.start, rotation.stop), "strain": strain}
        return {
            kind: normalised_square(self.e[part], self.S[part, part], inner if kind == "tip" else ALL)
            for kind, part in groups.items()
            if part.stop > part.start
        }

    @property
    def tip(self) -> float:
        """Distance of the tip from where it was said to be [m]."""
        return float(np.linalg.norm(self.e[self.parts[1]]))

    @property
    def tip_sigma(self) -> float:
        """One sigma of the tip's position, all directions together [m]."""
        return float(np.sqrt(self.S.diagonal()[self.parts[1]].sum()))


ALL = (slice(None),)


class Observables:
    """Observables of one served model."""

    def __init__(
        self,
        model: ReducedModel,
        kinematics: Kinematics,
        gauges: Sequence[str],
        config: EstimatorConfig | None = None,
    ) -> None:
        """Bind the model.

        Args:
            model: Served model.
            kinematics: Pose and Jacobian of the tip.
            gauges: Output rows "sensor.channel" of the strain gauges, in the order of the truth's.
            config: Of the estimator; None for one that learns no share of the sag.
        """
        rows = [model.outputs.names.index(name) for name in gauges]
        self._tip = PlainTip(model, kinematics)
        self._n, self._n_theta, self._xi0 = model.n, model.n_theta, np.array(model.xi0)
        self._strain, self._strain0 = model.outputs.C_pos[rows], model.outputs.y0[rows]
        config = config or EstimatorConfig()
        borne = kinematics.borne(model.q0) if config.sag_share > 0.0 else None
        self._beyond = sag_states(model, config, borne).beyond[rows]
        edges = np.cumsum([0, model.n_theta, 3, 3, len(rows)]).tolist()
        axes, position, rotation, strain = map(slice, edges[:-1], edges[1:])
        self._parts = (axes, position, rotation, strain)

    def compare(self, truth: TrueArm, x: Array, P: Array, w: slice = slice(0)) -> Deviation:
        """Return how far a state ``x`` (n_x,) of covariance ``P`` (n_x, n_x) with its shares ``w`` is off."""
        n, n_theta = self._n, self._n_theta
        T, J = self._tip.locate(x)
        strain = self._strain0 + self._strain @ (x[:n] - self._xi0) + self._beyond @ x[w]
        e = np.concatenate([
            truth.theta - x[:n_theta],
            truth.T_world_tip[:3, 3] - T[:3, 3],
            log_rotation(truth.T_world_tip[:3, :3] @ T[:3, :3].T),
            truth.strain - strain,
        ])  # fmt: skip
        H = np.zeros((e.size, x.size))
        H[:, :n] = np.vstack([np.eye(n_theta, n), J, self._strain])
        H[self._parts[3], w] = self._beyond
        return Deviation(e, H @ P @ H.T, self._parts)
