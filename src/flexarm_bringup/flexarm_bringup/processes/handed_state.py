"""An estimate as the controller reads it, without a message between."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexarm_controller.state import ArmState
from flexarm_estimator.estimate import Estimate
from flexarm_model.served.reduced_model import ReducedModel


@dataclass(frozen=True)
class HandedState:
    """An estimate that the controller reads as it would read its message.

    Attributes:
        estimate: Of the estimator beside.
        stamp_ns: Instant it belongs to [ns].
    """

    estimate: Estimate
    stamp_ns: int

    def read(self, model: ReducedModel, epoch_ns: int) -> ArmState:
        """Return the state in the coordinates of ``model``, times from ``epoch_ns`` [ns] on.

        One that does not fit the model comes back as not usable, with the reason.
        """
        told, layout, n, m = self.estimate, self.estimate.layout, model.n_theta, model.n_eta
        t = (self.stamp_ns - epoch_ns) * 1e-9
        if (layout.n_theta, layout.n - layout.n_theta) != (n, m):
            zero, none = np.zeros(n), np.zeros(m)
            sizes = f"{layout.n_theta} axes and {layout.n - layout.n_theta} modes"
            return ArmState(t, told.model_id, zero, none, zero, none, zero, False, f"state has {sizes}")
        variances = told.P.diagonal()[: 2 * (n + m)]
        sigma = np.sqrt(np.where(variances >= 0.0, variances, np.inf))
        return ArmState(
            t, told.model_id, told.theta, told.eta, told.theta_dot, told.eta_dot, told.d,
            told.is_usable, told.reason, sigma, told.x[layout.s], told.stiffness, told.age,
        )  # fmt: skip
