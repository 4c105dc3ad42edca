"""Watches how late the stamps of the cameras are, and says when it is not what is configured.

Every frame is compared, whether the gate takes it or not, with the tip as encoders and gauges said at the
time: not with the state, which a camera with wrong stamps spoils. With ``calibrate_latency`` the delay found
out is used, approached slowly; without, it is only told. Work is done when a frame is due, not in every step,
and not in one that fuses a late frame, which computes the past again and has enough to do.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.latency_fit import Latency, LatencyFit
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_estimator.watches.tip_prediction import TipPrediction
from flexarm_estimator.watches.tip_track import TipTrack
from flexarm_estimator.watches.watch import Finding, View, Watch

Array = NDArray[np.float64]
_EARLIEST, _LATEST, _STEP = -0.02, 0.2, 0.005  # s; the delays that are compared
_PATIENCE = 0.04  # s; a frame is compared so much after its stamp, when the tip is known on both sides
_TOGETHER = 0.001  # s; samples of encoders and gauges that belong together
_SIGMAS, _LEAST_DRIFT = 3.0, 0.005  # an alarm needs a drift of so many sigmas, and of so much [s]
_FIT_PERIOD = 0.25  # s
_MOST_WAITING = 100  # frames
_MOST_VIEWS = 1000  # steps
_MOST_BEHIND = 30  # steps; from here on the work is done in one with a frame, too


class LatencyWatch(Watch):
    """Calibrates the stamps of all cameras of an arm: of all sensors that see the tip's pose."""

    def __init__(self, delays: StampDelays, config: EstimatorConfig) -> None:
        """Start without frames.

        Args:
            delays: In use; changed here when ``calibrate_latency`` is set.
            config: Settings.
        """
        self._delays, self._config = delays, config
        self._track = TipTrack(_LATEST - _EARLIEST + config.history)
        self._views: deque[View] = deque(maxlen=_MOST_VIEWS)
        self._lines: dict[str, _Line] = {}

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch."""
        if not self._lines:
            return ()
        self._views.append(view)
        has_frame = False
        for sample in view.samples:
            if sample.sensor in self._lines:
                has_frame = True
                self._lines[sample.sensor].wait(sample, self._delays.of(sample.sensor))
        if has_frame and len(self._views) < _MOST_BEHIND:
            return ()
        due = [line for line in self._lines.values() if line.due_at <= view.t]
        if not due:
            return ()
        self._catch_up(min(line.due_at for line in due) - _PATIENCE - _LATEST)
        return [finding for line in due for finding in self._judge(line, view.t)]

    def restart(self, t: float) -> None:
        """See Watch; the delays in use are the configured ones again."""
        self._track.clear()
        self._views.clear()
        self._lines = {name: _Line(name, self._config.latency_memory) for name in self._lines}
        self._delays.restart()

    def use(self, parts: Parts) -> None:
        """See Watch."""
        if self._views:
            self._catch_up(self._views[-1].t - _LATEST + _EARLIEST - _PATIENCE)
        self._prediction = TipPrediction(parts)
        for name in parts.sensors.poses:
            self._lines.setdefault(name, _Line(name, self._config.latency_memory))

    def values(self) -> dict[str, dict[str, float]]:
        """See Watch."""
        values = {}
        for name, line in self._lines.items():
            values[name] = {"stamp delay in use [s]": self._delays.of(name)}
            if line.latency is not None:
                values[name]["stamp delay found [s]"] = line.latency.value
                values[name]["its one sigma [s]"] = line.latency.sigma
        return values

    def _catch_up(self, since: float) -> None:
        """Compute where the tip was in the steps from ``since`` [s] on that have not been looked at."""
        for view in self._views:
            if view.t >= since:
                self._follow_tip(view)
        self._views.clear()

    def _follow_tip(self, view: View) -> None:
        """Take the newest samples of encoders and gauges if they are complete and none is refused.

        What encoders alone say lags behind a tip that swings, which would look like another delay.
        """
        wanted = self._prediction.sensors
        judged = {v.sensor: v.is_accepted for v in view.verdicts if v.sensor in wanted}
        newest = {s.sensor: s for s in view.samples if s.sensor in judged}  # in order of time
        t = max([sample.t for sample in newest.values()], default=-np.inf)
        samples = {name: s.y for name, s in newest.items() if s.t >= t - _TOGETHER}
        is_complete = samples and wanted.issubset(samples) and all(judged.values())
        if is_complete and self._track.accepts(t):
            position = self._prediction.position(samples)
            if position is not None:
                self._track.add(t, position)

    def _judge(self, line: _Line, t: float) -> list[Finding]:
        """Compare what has waited long enough; approach what was found out, tell what has changed."""
        elapsed = line.compare(self._track, t)
        if not elapsed or line.latency is None:
            return []
        used, found = self._delays.of(line.camera), line.latency
        if self._config.calibrate_latency:
            most = self._config.latency_rate * elapsed
            used += min(max(found.value - used, -most), most)
            self._delays.use(line.camera, used)
        drifts = abs(found.value - used) > max(_SIGMAS * found.sigma, _LEAST_DRIFT)
        if drifts == line.is_alarmed:
            return []
        line.is_alarmed = drifts
        said = (f"{value * 1e3:.1f}" for value in (found.value, found.sigma, used))
        text = "stamps are {} ms late (one sigma {} ms), stamp_delay in use is {} ms".format(*said)
        return [Finding(line.camera, text if drifts else "")]


class _Line:
    """Frames of one camera, and what they say."""

    def __init__(self, camera: str, memory: float) -> None:
        self.camera, self.is_alarmed = camera, False
        self.latency: Latency | None = None
        count = round((_LATEST - _EARLIEST) / _STEP) + 1
        self._fit = LatencyFit(np.linspace(_EARLIEST, _LATEST, count), memory)
        self._waiting: deque[tuple[float, Array]] = deque(maxlen=_MOST_WAITING)
        self._last, self._unread = np.nan, 0.0

    @property
    def due_at(self) -> float:
        """When the next frame can be compared [s]; infinity when none waits."""
        return self._waiting[0][0] + _PATIENCE if self._waiting else np.inf

    def wait(self, sample: Measurement, delay: float) -> None:
        """Keep a frame until the tip is known around its stamp, which was ``delay`` [s] later."""
        self._waiting.append((sample.t + delay, sample.y[:3]))

    def compare(self, track: TipTrack, t: float) -> float:
        """Add the frames that are due at ``t`` [s].

        Returns:
            Time since the fit was made before [s]; 0 when it has not been made anew.
        """
        elapsed = 0.0
        while self.due_at <= t:
            stamp, position = self._waiting.popleft()
            if not track.covers(stamp - _LATEST, stamp - _EARLIEST):
                continue
            since = max(0.0, stamp - self._last) if np.isfinite(self._last) else 0.0
            self._last = stamp
            elapsed += since
            self._fit.add(position - track.positions(stamp - self._fit.candidates), since)
        self._unread += elapsed
        if self._unread < _FIT_PERIOD:
            return 0.0
        elapsed, self._unread = self._unread, 0.0
        self.latency = self._fit.result()
        return elapsed
