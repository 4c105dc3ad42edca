"""What is said of a camera whose stamps are not as late as is configured, and when it is put out of use."""

from __future__ import annotations

import math

from flexarm_estimator.watches.latency_fit import Latency
from flexarm_estimator.watches.watch import Finding

_SIGMAS, _LEAST_DRIFT = 3.0, 0.005  # an alarm needs a drift of so many sigmas, and of so much [s]
_NEWS = 0.002  # s; what was said is said anew when so much has changed


class StampAlarm:
    """The alarm of one camera.

    Attributes:
        is_out: The camera has been put out of use.
    """

    def __init__(self, camera: str) -> None:
        """Start without a word."""
        self._camera, self._is_on, self._drift = camera, False, 0.0
        self._found = Latency(0.0, 0.0)
        self.is_out = False

    def tell(self, found: Latency, used: float, is_spare: bool) -> list[Finding]:
        """Return what is new.

        Args:
            found: Delay of the stamps.
            used: The one in use [s].
            is_spare: The camera may be put out of use.
        """
        self._found, drift = found, found.value - used
        is_on = is_drift(drift, found.sigma)
        is_out = is_on and drift > 0.0 and is_spare
        is_other = (is_on, is_out) != (self._is_on, self.is_out)
        if not is_other and not (is_on and abs(drift - self._drift) > _NEWS):
            return []
        findings = []
        if is_other and self._is_on:
            findings.append(Finding(self._camera, "", is_fault=self.is_out))
        if is_on:
            is_new = is_out and not self.is_out  # then its frames are taken out of all the past that is left
            since = -math.inf if is_new else math.inf
            findings.append(Finding(self._camera, _words(found, used), is_fault=is_out, since=since))
        self._is_on, self.is_out, self._drift = is_on, is_out, drift
        return findings

    def readmit(self, used: float) -> list[Finding]:
        """Return what is new when the camera is not spare any more; ``used`` is the delay in use [s]."""
        return self.tell(self._found, used, is_spare=False) if self.is_out else []


def is_drift(drift: float, sigma: float) -> bool:
    """Return whether a delay is told to be other than the one in use, by ``drift`` ± ``sigma`` [s]."""
    return abs(drift) > max(_SIGMAS * sigma, _LEAST_DRIFT)


def _words(found: Latency, used: float) -> str:
    late, sigma, used_ms = (f"{value * 1e3:.1f}" for value in (abs(found.value), found.sigma, used))
    said = f"stamps are {late} ms late" if found.value >= 0.0 else f"stamps are {late} ms early"
    return f"{said} (one sigma {sigma} ms), stamp_delay in use is {used_ms} ms"
