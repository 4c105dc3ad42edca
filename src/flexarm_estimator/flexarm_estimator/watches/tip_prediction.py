"""The tip as encoders and gauges alone say it, without filter, torque or camera.

Rows that feel neither velocity nor acceleration read ``y = C xi + y_c + v``. From those of one instant, the
most probable coordinates are ``xi = xi0 + P0 C' (C P0 C' + R)^-1 (y - C xi0 - y_c)``: the encoders place the
axes, and the gauges' strain is shared out among the modes by how much each is expected to move (P0).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]


class TipPrediction:
    """Tip from samples, with one served model.

    Attributes:
        sensors: Those that read positions: encoders and gauges.
        variance: Of their noise in the tip's position, all directions together [m^2].
    """

    def __init__(self, parts: Parts) -> None:
        """Pick the sensors that read positions."""
        n = parts.model.n
        rows = {
            name: model
            for name, model in parts.sensors.rows.items()
            if not model.D_w.any() and not model.C[:, n : 2 * n].any()
        }
        self.sensors = frozenset(rows)
        self._rows, self._parts = rows, parts
        gain, constant = self._map()
        self._sight = parts.tip.sight(gain, constant)
        self.variance = self._noise(gain)

    def position(self, samples: Mapping[str, Measurement]) -> Array | None:
        """Return the tip's position [m], (3,), from samples of all ``sensors``.

        None where the samples ask for what the loops do not allow.
        """
        values: list[float] = []
        for name in self._rows:  # on so few numbers cheaper than joining arrays
            values += samples[name].y.tolist()
        try:
            return self._sight.position(values)
        except ClosureError:
            return None

    def _noise(self, gain: Array) -> float:
        """Return the variance of the position at the operating point [m^2]."""
        model, noise = self._parts.model, [row.R.diagonal() for row in self._rows.values()]
        x = np.zeros(gain.shape[0])
        x[: model.n] = model.xi0
        moved = self._parts.tip.locate(x)[1][:3].dot(gain[: model.n])
        return float((moved * moved).dot(np.concatenate([*noise, np.zeros(0)])).sum())

    def _map(self) -> tuple[Array, Array]:
        """Return gain (n_x, m) and constant (n_x,) of ``x = gain y + constant``."""
        parts = self._parts
        n, n_x = parts.model.n, parts.layout.n_x
        x, u = np.zeros(n_x), np.append(np.zeros(parts.model.n_theta), 1.0)
        x[:n] = parts.model.xi0
        if not self._rows:
            return np.zeros((n_x, 0)), x
        P0 = parts.process.P0[:n, :n]
        models = list(self._rows.values())
        C = np.vstack([model.C[:, :n] for model in models])
        R = np.diag(np.concatenate([model.R.diagonal() for model in models]))
        gain = np.zeros((n_x, C.shape[0]))
        gain[:n] = np.linalg.solve(C @ P0 @ C.T + R, C @ P0).T
        nothing = np.concatenate([model.innovation(np.zeros(model.R.shape[0]), x, u) for model in models])
        return gain, x + gain @ nothing
