"""Whether somebody may be at fault: innovations that are larger than they should be, and since when.

What the filter learns of the arm it has from the same channels: what counts is what had been learned before.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection

from flexarm_estimator.watches.watch import View

_MEMORY = 0.9  # of the mean squared innovation from one look to the next
_MOST_OF_ONE = 100.0  # squared sigmas of one innovation
_SUSPICIOUS = 1.5  # mean squared normalised innovation of a sensor
_BEFORE = 10  # ticks that something is wrong before it is suspected, at most
_DOUBT = 400  # ticks of a suspicion, or of a sensor's silence, after which the arm is no longer what it was


class Suspicion:
    """Looks at the verdicts.

    Attributes:
        first_tick: The first tick of the present suspicion; 0 without.
    """

    def __init__(self) -> None:
        """Suspect nobody."""
        self.first_tick = 0
        self._squares: dict[str, float] = {}
        self._heard: dict[str, int] = {}  # tick
        self._known: deque[tuple[float, ...]] = deque(maxlen=_BEFORE)  # learned, without suspicion

    def learned_before(self, learned: tuple[float, ...], ticks: int) -> tuple[float, ...]:
        """Return what had been ``learned`` (n_p,) of the arm before there was any suspicion."""
        if not self.first_tick or ticks - self.first_tick > _DOUBT or not self._known:
            self._known.append(learned)
        return self._known[0]

    def note(self, view: View, tick: int, listed: Collection[str], known: Collection[str]) -> None:
        """Look at the verdicts of a tick.

        Args:
            view: What there is to see.
            tick: Number of this tick.
            listed: Sensors that may be suspected when something else has put them out of use.
            known: Those that are known to be at fault.
        """
        squares = self._squares
        for sensor, _, _, _, normalised, _, _ in view.verdicts:
            square = normalised**2
            square = square if square < _MOST_OF_ONE else _MOST_OF_ONE
            squares[sensor] = square + _MEMORY * (squares.get(sensor, 0.0) - square)
            self._heard[sensor] = tick
        if len(view.verdicts) < len(view.samples):
            heard = {verdict.sensor for verdict in view.verdicts}
            for sample in view.samples:
                if sample.sensor in listed and sample.sensor not in heard and sample.sensor not in known:
                    squares[sample.sensor] = 2.0 * _SUSPICIOUS
                    self._heard[sample.sensor] = tick
        if self.first_tick:
            for sensor in [name for name, last in self._heard.items() if tick - last > _DOUBT]:
                del squares[sensor], self._heard[sensor]  # unplugged, say: it says nothing any more
        is_suspicious = max(squares.values(), default=0.0) >= _SUSPICIOUS
        self.first_tick = (self.first_tick or tick) if is_suspicious else 0

    def rest(self) -> None:
        """Begin anew: somebody has been named, whose innovations these were."""
        self._squares.clear()
        self._heard.clear()
