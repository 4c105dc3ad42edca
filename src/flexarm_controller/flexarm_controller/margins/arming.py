"""What stands between a controller and its first torque: the margins of its loop, known and large enough.

The first model and the filter that the estimator has settled on for it are judged as soon as both are there,
and again when the estimator is tuned otherwise; never while the guard is armed, for judging takes a while and
a verdict against the loop would end the commands of a moving arm. An estimator that tells no filter, or one
that cannot be read, counts as a verdict and waits as well.
A controller that is started while the arm stands elsewhere finds a filter of an earlier model: it asks for
one of its own.
"""

from __future__ import annotations

from flexarm_controller.margins.gate import Gate
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.steady_filter import SteadyFilter

UNKNOWN = "margins: not known before the estimator tells its settled filter"


class Arming:
    """Keeps the newest verdict.

    Attributes:
        reason: Why nothing may be sent; empty when it may.
        is_known: There has been a verdict.
    """

    def __init__(self, gate: Gate | None) -> None:
        """Start without a verdict; without a gate everything may be sent."""
        self._gate = gate
        self._filter: SteadyFilter | None = None
        self._fault = ""
        self.reason, self.is_known = "" if gate is None else UNKNOWN, gate is None

    def take(self, filter_: SteadyFilter | None, fault: str = "") -> None:
        """Take a filter, to be judged by the next ``look``; without one ``fault`` says why."""
        self._filter, self._fault = filter_, "" if filter_ is not None else f"margins: {fault}"

    def is_of_another(self, model: ReducedModel | None, is_armed: bool) -> bool:
        """Return whether a filter waits that is not of ``model``, and a new one may be asked for."""
        if self._filter is None or model is None or is_armed or self._gate is None:
            return False
        return self._filter.model_id != model.model_id

    def look(self, model: ReducedModel | None, is_armed: bool) -> bool:
        """Judge what waits, if it can be judged now; return whether there is a new verdict."""
        if self._gate is None or is_armed:
            return False
        reason = self._fault
        if not reason:
            if self._filter is None or model is None or self._filter.model_id != model.model_id:
                return False
            reason = self._gate.judge(model, self._filter)
        self.reason, self.is_known = reason, True
        self._filter, self._fault = None, ""
        return True
