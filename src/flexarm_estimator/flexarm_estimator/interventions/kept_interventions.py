"""Interventions that stand, over the life of an estimator's process: kept by one, done again by the next."""

from __future__ import annotations

from collections.abc import Callable

from flexarm_estimator.exchange import EstimatorExchange
from flexarm_estimator.interventions.standing import read_standing, write_standing
from flexarm_model.process.kept import Kept


class KeptInterventions:
    """What stands, of one estimator after the other."""

    def __init__(self, node: str, warn: Callable[[str], object]) -> None:
        """Read what the process before has kept.

        Args:
            node: Full name, "/flexarm/estimator".
            warn: Told of what is done again, and of what is lost.
        """
        self._warn, self._kept = warn, Kept(node)

    def hand_to(self, exchange: EstimatorExchange) -> None:
        """Have a new exchange do again what stands, before its first step."""
        try:
            standing = read_standing(self._kept.read())
        except (OSError, ValueError) as error:
            self._warn(f"what services had switched or set before is lost: {error}")
            return
        exchange.resume(standing)
        if standing:
            said = "; ".join(each.describe() for each in standing)
            self._warn(f"goes on with what services had switched or set before: {said}")

    def take_from(self, exchange: EstimatorExchange) -> None:
        """Keep what stands now."""
        try:
            self._kept.keep(write_standing(exchange.standing))
        except OSError as error:
            self._warn(f"a crash would lose what services have switched or set: {error}")
