"""Forget the state."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.intervention import Intervention


@dataclass(frozen=True)
class Reset(Intervention):
    """Start anew with the next step; the model stays."""

    def check(self, estimator: Estimator) -> None:
        """See Intervention; it can always be done."""

    def apply(self, estimator: Estimator) -> None:
        """See Intervention."""
        estimator.reset()

    def describe(self) -> str:
        """See Intervention."""
        return "starting anew"
