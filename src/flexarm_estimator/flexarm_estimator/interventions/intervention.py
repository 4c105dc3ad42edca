"""What all interventions have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

from flexarm_estimator.estimator import Estimator

MOST = 1e6  # SI; of anything that a state or its noise may have
LEAST_SIGMA = 1e-12  # SI


class InterventionError(ValueError):
    """It cannot be done; the text names field, value and what is allowed."""


class Intervention(ABC):
    """Something to do to the estimator between two steps."""

    @abstractmethod
    def check(self, estimator: Estimator) -> None:
        """Prove that it can be done.

        Raises:
            InterventionError: It cannot.
        """

    @abstractmethod
    def apply(self, estimator: Estimator) -> None:
        """Do it; ``check`` has passed."""

    @abstractmethod
    def describe(self) -> str:
        """Return what will be done, in one line."""


def require_numbers(field: str, values: Sequence[float], counts: Sequence[int], least: float) -> None:
    """Check an array.

    Args:
        field: Its name.
        values: Its numbers.
        counts: How many there may be.
        least: Smallest value allowed; the largest is ``MOST``.

    Raises:
        InterventionError: It is not like that.
    """
    if len(values) not in counts:
        allowed = " or ".join(str(count) for count in sorted(set(counts)))
        raise InterventionError(f"{field}: {len(values)} numbers; allowed: {allowed}")
    for value in values:
        if not least <= value <= MOST:  # also NaN
            raise InterventionError(f"{field}: {value}; allowed: from {least:g} to {MOST:g}, SI")
