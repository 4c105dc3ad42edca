"""Watches how late the stamps of the cameras are, and says when it is not what is configured.

Every frame is compared, whether the gate takes it or not, with the tip as encoders and gauges said at the
time: not with the state, which a camera with wrong stamps spoils. With ``calibrate_latency`` the delay found
out is used, approached slowly; without, it is only told. Work is done when a frame is due, not in every step,
and not in one that fuses a late frame, which computes the past again and has enough to do.
"""

from __future__ import annotations

import math
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
from flexarm_model.manipulator.sensor_kinds import TRANSLATION

Array = NDArray[np.float64]
_EARLIEST, _LATEST, _STEP = -0.02, 0.2, 0.005  # s; the delays that are compared
_PATIENCE = 0.04  # s; a frame is compared so much after its stamp, when the tip is known on both sides
_TOGETHER = 0.001  # s; samples of encoders and gauges that belong together
_SIGMAS, _LEAST_DRIFT = 3.0, 0.005  # an alarm needs a drift of so many sigmas, and of so much [s]
_FIT_PERIOD = 0.25  # s
_MOST_WAITING = 100  # frames
_MOST_BEHIND = 5  # steps; from here on the work is done in one with a frame, too


class LatencyWatch(Watch):
    """Calibrates the stamps of all cameras of an arm: of those that see all of the tip's position."""

    def __init__(self, delays: StampDelays, config: EstimatorConfig) -> None:
        """Start without frames.

        Args:
            delays: In use; changed here when ``calibrate_latency`` is set.
            config: Settings.
        """
        self._delays, self._config = delays, config
        self._length = _LATEST - _EARLIEST + config.history
        self._track = TipTrack(self._length)
        self._views: deque[View] = deque()
        self._lines: dict[str, _Line] = {}

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch."""
        if not self._lines:
            return ()
        self._views.append(view)
        if self._has_frame(view) and len(self._views) < _MOST_BEHIND:
            return ()
        due = []
        for line in self._lines.values():
            if line.unread >= _FIT_PERIOD:
                return self._judge(line)
            if line.due_at <= view.t:
                due.append(line)
        self._follow_tip(at_once=bool(due))
        for line in due:
            line.compare(self._track, view.t)
        return ()

    def _has_frame(self, view: View) -> bool:
        """Return whether a frame has come; let it wait for its turn."""
        lines = self._lines
        frames = [sample for sample in view.samples if sample.sensor in lines]
        for frame in frames:
            lines[frame.sensor].wait(frame, self._delays.of(frame.sensor))
        return bool(frames)

    def restart(self, t: float) -> None:
        """See Watch; the delays in use are the configured ones again."""
        self._track.clear()
        self._views.clear()
        self._lines = {name: _Line(name, self._config.latency_memory) for name in self._lines}
        self._delays.restart()

    def use(self, parts: Parts) -> None:
        """See Watch."""
        if not self._lines:  # the first model
            self._track = TipTrack(self._length, min(parts.model.omega, default=0.0))
        self._follow_tip(at_once=True)
        self._prediction = TipPrediction(parts)
        for name, model in parts.sensors.poses.items():
            if model.channels[:3] == TRANSLATION:
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

    def _follow_tip(self, at_once: bool) -> None:
        """Compute where the tip was in the steps that wait for it: in one of them, or in all at once."""
        while self._views:
            view = self._views.popleft()
            if view.samples and self._track.accepts(view.samples[-1].t):
                self._follow(view)
                if not at_once:
                    return

    def _follow(self, view: View) -> None:
        """Take the newest samples of encoders and gauges if they are complete and none is refused.

        What encoders alone say lags behind a tip that swings, which would look like another delay.
        """
        wanted = self._prediction.sensors
        judged = {name: is_fused for name, _, is_fused, _, _, _, _ in view.verdicts if name in wanted}
        newest = {s.sensor: s for s in view.samples if s.sensor in judged}  # in order of time
        if not newest or len(newest) < len(wanted) or not all(judged.values()):
            return
        stamps = [sample.t for sample in newest.values()]
        t = max(stamps)
        if min(stamps) >= t - _TOGETHER and self._track.accepts(t):
            position = self._prediction.position(newest)
            if position is not None:
                self._track.add(t, position)

    def _judge(self, line: _Line) -> list[Finding]:
        """Find out the delay anew; approach what was found out, tell what has changed."""
        elapsed = line.read(self._prediction.variance)
        if line.latency is None:
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
    """Frames of one camera, and what they say.

    Attributes:
        due_at: When the next frame can be compared [s]; infinity when none waits.
        unread: Time over which frames have been compared since the delay was found out [s].
    """

    def __init__(self, camera: str, memory: float) -> None:
        self.camera, self.is_alarmed = camera, False
        self.latency: Latency | None = None
        count = round((_LATEST - _EARLIEST) / _STEP) + 1
        self._fit = LatencyFit(np.linspace(_EARLIEST, _LATEST, count), memory)
        self._waiting: deque[tuple[float, Array]] = deque(maxlen=_MOST_WAITING)
        self._last, self.unread, self.due_at = math.nan, 0.0, math.inf

    def wait(self, sample: Measurement, delay: float) -> None:
        """Keep a frame until the tip is known around its stamp, which was ``delay`` [s] later."""
        self._waiting.append((sample.t + delay, np.array(sample.y[:3])))
        self._look_ahead()

    def compare(self, track: TipTrack, t: float) -> None:
        """Add the frames that are due at ``t`` [s]."""
        while self.due_at <= t:
            stamp, position = self._waiting.popleft()
            self._look_ahead()
            if not track.covers(stamp - _LATEST, stamp - _EARLIEST):
                continue
            since = max(0.0, stamp - self._last) if math.isfinite(self._last) else 0.0
            self._last = stamp
            self.unread += since
            self._fit.compare(track, stamp, position, since)

    def read(self, noise: float) -> float:
        """Find out the delay; return the time since that was done before [s].

        Args:
            noise: Variance of the predicted positions [m^2].
        """
        elapsed, self.unread = self.unread, 0.0
        self.latency = self._fit.result(noise)
        return elapsed

    def _look_ahead(self) -> None:
        self.due_at = self._waiting[0][0] + _PATIENCE if self._waiting else math.inf
