"""The models that have been sent, each for its time, and those that a reference put aside.

A reference may be refused by whoever follows it, after its models are out. Then they are taken back: from its
begin on what was used before is used again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.pending_models import PendingModels
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
Timed = tuple[int, ReducedModel]  # stamp from which it is used [ns]
AHEAD_NS, SOON_NS = 500_000_000, 150_000_000  # before its time a model made anew is sent, and must be
SPREAD_NS = 50_000_000  # between two of them where there is time
NEVER_NS = 2**62


class ServedModels:
    """Sends models and remembers from when each is used.

    Attributes:
        newest: The model sent last.
        count: Models sent so far [1].
    """

    def __init__(self, first: ReducedModel, send: Callable[[ReducedModel, int], None]) -> None:
        """Send the first model, to be used from the beginning.

        Args:
            first: The model.
            send: Sends a model that is used from a stamp [ns] on.
        """
        self._send, self._in_use = send, first
        self._pending: PendingModels[ReducedModel] = PendingModels()
        self._start_ns, self._aside, self._before = -1, tuple[Timed, ...](), first
        self._later: deque[tuple[int, Array]] = deque()  # to be made anew and sent in turn
        self._sent_ns = NEVER_NS
        self._make: Callable[[Array], ReducedModel] = lambda pose: first
        self.count = 0
        self.serve(first, 0)

    @property
    def receipt(self) -> str:
        """Count and hash of all that was sent."""
        return self._pending.receipt

    def serve(self, model: ReducedModel, stamp_ns: int) -> None:
        """Send a model; it voids those for its stamp [ns] and later ones, also those not made anew yet."""
        self._later.clear()
        self._put(model, stamp_ns)

    def _put(self, model: ReducedModel, stamp_ns: int) -> None:
        self.newest = model
        self.count += 1
        self._pending.add(stamp_ns, model)
        self._pending.note(stamp_ns, model.model_id)
        self._send(model, stamp_ns)

    def has_after(self, stamp_ns: int) -> bool:
        """Tell whether a model waits for a later time [ns]."""
        return self._pending.has_after(stamp_ns) or bool(self._later)

    def at(self, stamp_ns: int) -> ReducedModel:
        """Return the model that is in use at a stamp [ns], later than what ``pass_by`` was told."""
        due = [model for since_ns, model in self._pending.waiting if since_ns <= stamp_ns]
        return due[-1] if due else self._in_use

    def pass_by(self, now_ns: int) -> None:
        """Forget what was used before now [ns]: nothing is asked of it, or taken back to it, any more."""
        self._in_use = self._pending.due(now_ns) or self._in_use

    def serve_motion(self, models: Sequence[Timed], start_ns: int) -> None:
        """Send the models of a motion; what was sent for later than its begin is put aside.

        Args:
            models: Of the motion, with the times since its begin [ns].
            start_ns: Its begin [ns].
        """
        self._send_all()
        later = tuple((since_ns, model) for since_ns, model in self._pending.waiting if since_ns > start_ns)
        self._start_ns, self._aside, self._before = start_ns, later, self.at(start_ns)
        if self._aside:
            self.serve(self._before, start_ns)
        for after_ns, model in models:
            self.serve(model, start_ns + after_ns)

    def renew(self, make: Callable[[Array], ReducedModel], since_ns: int) -> None:
        """Send what is used from a time on [ns] once more, made anew at its pose, and later ones in turn.

        Args:
            make: Makes a model of a pose, (n_theta,).
            since_ns: From when on what is made anew is used [ns].
        """
        later = [(ns, model.pose) for ns, model in self._pending.waiting] + list(self._later)
        aside, before = tuple((ns, make(model.pose)) for ns, model in self._aside), make(self._before.pose)
        self._put(make(self.at(since_ns).pose), since_ns)
        self._aside, self._before, self._make = aside, before, make
        self._later = deque((ns, pose) for ns, pose in later if ns > since_ns)

    def go_on(self, now_ns: int) -> bool:
        """Send the next model that is made anew when it is time to [ns]; return whether one was sent.

        Whoever takes a model needs most of a period for it: not all of a motion may come at once.
        """
        ahead_ns = self._later[0][0] - now_ns if self._later else NEVER_NS
        if ahead_ns > AHEAD_NS or (ahead_ns > SOON_NS and 0 <= now_ns - self._sent_ns < SPREAD_NS):
            return False
        stamp_ns, pose = self._later.popleft()
        self._put(self._make(pose), stamp_ns)
        self._sent_ns = now_ns
        return True

    def _send_all(self) -> None:
        while self._later:
            self.go_on(self._later[0][0])

    def take_back(self, start_ns: int) -> bool:
        """Undo the motion that begins then [ns]; return whether it is the last one."""
        if start_ns != self._start_ns:
            return False
        self._later.clear()
        if self.newest is not self._before:
            self.serve(self._before, start_ns)
        for stamp_ns, model in self._aside:
            self.serve(model, stamp_ns)
        self._start_ns, self._aside = -1, ()
        return True
