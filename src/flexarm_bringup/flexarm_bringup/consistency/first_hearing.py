"""What the estimator makes of a bag by itself, before anything is tuned on it.

It finds out how late the cameras stamp, and puts sensors out of use that are at fault. The likelihood hears
these all the same: a sigma that is far too small looks like a fault, too, and is what is to be found.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from flexarm_bringup.consistency.late_stamps import LateStamps, late_stamps
from flexarm_bringup.consistency.recording import LAST, NoController, Recording
from flexarm_bringup.replaying.player import Player
from flexarm_estimator.estimate import SensorReport
from flexarm_estimator.exchange import EstimatorExchange


@dataclass
class OutOfUse:
    """That a sensor was put out of use.

    Attributes:
        reason: Why, at first.
        begin, end: When for the first and for the last time [s].
        steps: In how many steps of the estimator [1].
    """

    reason: str
    begin: float
    end: float
    steps: int = 0

    def describe(self, sensor: str, of: int, start: float) -> str:
        """Return what a reader should know; ``of`` steps there were, from ``start`` [s] on."""
        share = 100.0 * self.steps / of
        return (
            f"{sensor} counts throughout, but the estimator had it out of use in {share:.0f} % of the bag, "
            f"from {self.begin - start:.2f} to {self.end - start:.2f} s ({self.reason}): where it was at "
            "fault, tune on another bag; where its sigma is wrong, this is how it is found"
        )


class FirstHearing:
    """Notes what the estimator says of the sensors.

    Attributes:
        late: How late the cameras stamp.
    """

    def __init__(self) -> None:
        """Begin."""
        self.late: list[LateStamps] = []
        self._found: dict[str, OutOfUse] = {}
        self._start, self._steps = 0.0, 0

    def note(self, t: float, reports: Iterable[SensorReport]) -> None:
        """Note a step at ``t`` [s]."""
        self._start = self._start if self._steps else t
        self._steps += 1
        for report in reports:
            if report.status == "faulty":
                found = self._found.setdefault(report.name, OutOfUse(report.reason, t, t))
                found.end, found.steps = t, found.steps + 1

    def describe(self) -> list[str]:
        """Return one line for every sensor that was put out of use."""
        return [found.describe(name, self._steps, self._start) for name, found in self._found.items()]


def hear(recording: Recording) -> FirstHearing:
    """Play a bag to an estimator with the settings of its own."""
    exchange = EstimatorExchange(recording.config, recording.settings, recording.epoch_ns, recording.config)
    heard = FirstHearing()
    for _, outgoing in Player(exchange, NoController(), recording.lockstep).play(recording.bag.records):
        if outgoing.topic == LAST and exchange.estimate is not None:
            heard.note(exchange.estimate.t, exchange.estimate.sensors)
    figures = exchange.estimator.figures() if exchange.estimator is not None else {}
    heard.late = late_stamps(figures, recording.config.sensors)
    return heard
