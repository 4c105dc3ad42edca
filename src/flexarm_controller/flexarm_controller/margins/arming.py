"""What stands between a controller and its first torque: the margins of its loop, known and large enough.

The first model and the filter that the estimator has settled on for it are judged as soon as both are there,
and again when the estimator is tuned otherwise; never while the guard is armed, for judging takes a while and
a verdict against the loop would end the commands of a moving arm. An estimator that tells no filter, or one
that cannot be read, counts as a verdict and waits as well.
A verdict is of the model that was judged. Where the guard stops the arm elsewhere nothing may be sent until
the loop has been judged there: a filter of the model in use is asked for when that has been the same for
``hold``, so not while the arm still moves or is pushed. A controller that is started while the arm stands
elsewhere finds a filter of an earlier model: it asks for one of its own.
"""

from __future__ import annotations

import math

from flexarm_controller.margins.gate import Gate
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.steady_filter import SteadyFilter

UNKNOWN = "margins: not known before the estimator tells its settled filter"
ELSEWHERE = "margins: not known where the arm is now, judged once it rests; try again in some seconds"
HOLD = 0.3  # s; while the arm moves there are up to 20 models a second


class Arming:
    """Keeps the newest verdict.

    Attributes:
        reason: Why nothing may be sent; empty when it may.
        is_known: There has been a verdict.
    """

    def __init__(self, gate: Gate | None, hold: float = HOLD) -> None:
        """Start without a verdict.

        Args:
            gate: Judges; without one everything may be sent.
            hold: How long a model is in use before it is judged in place of another [s]; for ever: the first
                verdict holds wherever the arm stands.
        """
        self._gate, self._hold = gate, hold
        self._filter: SteadyFilter | None = None
        self._fault = ""
        self._judged, self._used, self._since = "", "", -math.inf
        self.reason, self.is_known = "" if gate is None else UNKNOWN, gate is None

    def take(self, filter_: SteadyFilter | None, fault: str = "") -> None:
        """Take a filter, to be judged by the next ``look``; without one ``fault`` says why."""
        self._filter, self._fault = filter_, "" if filter_ is not None else f"margins: {fault}"

    def wants_filter(self, model: ReducedModel | None, is_armed: bool, now: float) -> bool:
        """Return whether a filter of ``model``, in use at ``now`` [s], may be asked for and is not there."""
        if model is None or is_armed or self._gate is None:
            return False
        if self._filter is not None:
            return self._filter.model_id != model.model_id
        is_same = model.model_id == self._used and now - self._since >= self._hold
        return self._is_elsewhere(model) and is_same

    def look(self, model: ReducedModel | None, is_armed: bool, now: float) -> bool:
        """Judge what waits, if it can be judged now; return whether there is another reason, or a verdict.

        Args:
            model: In use.
            is_armed: The guard lets commands pass.
            now: Any clock that does not jump [s].
        """
        if self._gate is None or is_armed:
            return False
        if model is not None and model.model_id != self._used:
            self._used, self._since = model.model_id, now
        reason = self._fault
        if not reason:
            if self._filter is None or model is None or self._filter.model_id != model.model_id:
                return self._withhold_elsewhere(model)
            reason = self._gate.judge(model, self._filter)
        self.reason, self.is_known = reason, True
        self._judged = "" if model is None else model.model_id
        self._filter, self._fault = None, ""
        return True

    def _withhold_elsewhere(self, model: ReducedModel | None) -> bool:
        """Withhold everything where nothing was judged; return whether that is new."""
        if model is None or not self._is_elsewhere(model) or self.reason == ELSEWHERE:
            return False
        self.reason = ELSEWHERE
        return True

    def _is_elsewhere(self, model: ReducedModel) -> bool:
        """Return whether another model was judged, and this one is to be judged, too."""
        return self._judged not in ("", model.model_id) and math.isfinite(self._hold)
