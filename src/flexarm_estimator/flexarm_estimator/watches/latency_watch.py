"""Watches how late the stamps of the cameras are, and says when it is not what is configured.

Every frame is compared, whether the gate takes it or not, with the tip as encoders and gauges said at the
time: not with the state, which a camera with wrong stamps spoils. With ``calibrate_latency`` the delay found
out is used, approached slowly; without, it is only told. Work is done when a frame is due, not in every step,
and not in one that fuses a late frame, which computes the past again and has enough to do.

A camera whose stamps are later than the delay in use explains is put out of use until they are not, while
encoders tell where all axes are: no encoder tells what has yet to come, so that it is not theirs to be wrong.
One whose stamps are too early is only told of: encoders that lag look the same.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from flexarm_estimator.judging.coverage import Coverage
from flexarm_estimator.parts import Parts
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.camera_line import EARLIEST, LATEST, CameraLine
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_estimator.watches.tip_prediction import TipPrediction
from flexarm_estimator.watches.tip_track import TipTrack
from flexarm_estimator.watches.watch import Finding, View, Watch
from flexarm_model.manipulator.sensor_kinds import TRANSLATION

_TOGETHER = 0.001  # s; samples of encoders and gauges that belong together
_UNHEARD = 0.2  # s; without encoders and gauges for so long, a camera that stamps late is better than none
_FIT_PERIOD = 0.25  # s
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
        self._length = LATEST - EARLIEST + config.history
        self._track = TipTrack(self._length)
        self._views: deque[View] = deque()
        self._lines: dict[str, CameraLine] = {}

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch."""
        if not self._lines:
            return ()
        self._views.append(view)
        has_frame = self._has_frame(view)
        if self._track.newest < view.t - _UNHEARD and (findings := self._readmit()):
            return findings
        if has_frame and len(self._views) < _MOST_BEHIND:
            return ()
        return self._work(view.t)

    def _work(self, t: float) -> Sequence[Finding]:
        """Do one thing that is to be done at ``t`` [s]: judge a camera, compare frames, follow the tip."""
        lines = self._lines.values()
        for line in lines:
            if line.unread >= _FIT_PERIOD:
                return self._judge(line)
        due = [line for line in lines if line.due_at <= t]
        self._follow_tip(at_once=bool(due))
        for line in due:
            line.compare(self._track, t)
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
        self._lines = {name: CameraLine(name, self._config.latency_memory) for name in self._lines}
        self._delays.restart()

    def use(self, parts: Parts) -> None:
        """See Watch."""
        if not self._lines:  # the first model
            self._track = TipTrack(self._length, min(parts.model.omega, default=0.0))
        self._follow_tip(at_once=True)
        self._prediction = TipPrediction(parts)
        for name, model in parts.sensors.poses.items():
            if model.channels[:3] == TRANSLATION:
                self._lines.setdefault(name, CameraLine(name, self._config.latency_memory))
            else:
                self._lines.pop(name, None)
        sensors = parts.sensors.all()
        coverage = Coverage({name: model.axes for name, model in sensors.items()})
        bits = (coverage.bits.get(name, 0) for name in self._prediction.sensors)
        self._is_spare = coverage.covers(sum(bits))  # any camera

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

    def _judge(self, line: CameraLine) -> list[Finding]:
        """Look for a change; next time find out the delay anew, approach it and tell what is new."""
        if not line.is_searched:
            line.search(self._prediction.variance)
            return []
        elapsed = line.read(self._prediction.variance)
        if line.latency is None:
            return []
        used, found = self._delays.of(line.camera), line.latency
        if self._config.calibrate_latency:
            most = self._config.latency_rate * elapsed
            used += min(max(found.value - used, -most), most)
            self._delays.use(line.camera, used)
        return line.alarm.tell(found, used, self._is_spare)

    def _readmit(self) -> list[Finding]:
        """Hear those again that were put out of use: nobody else tells where the axes are."""
        lines = self._lines.values()
        return [finding for line in lines for finding in line.alarm.readmit(self._delays.of(line.camera))]
