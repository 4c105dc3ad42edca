"""What the drift watch says, as diagnostics and back."""

from __future__ import annotations

from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from flexarm_estimator.drift.drift_watch import DriftWatch
from flexarm_estimator.drift.judgement import ModeNow
from flexarm_model.conversions import ns_to_stamp

PREFIX = "drift: "
_KEYS = (
    "described [Hz]", "frequency [Hz]", "one sigma of it [Hz]", "described damping [1]", "damping [1]",
    "one sigma of the damping [1]",
)  # fmt: skip
_PROPOSAL = "proposal"


@dataclass(frozen=True)
class ToldMode:
    """A mode as a message tells it; the numbers are those of ``ModeNow``.

    Attributes:
        name: Of the mode.
        has_drifted: An alarm is on.
        text: What is said.
        numbers: In the order of the keys, (6,).
    """

    name: str
    has_drifted: bool
    text: str
    numbers: tuple[float, ...]


def drift_to_msg(watch: DriftWatch | None, fault: str, stamp_ns: int) -> DiagnosticArray:
    """Return the diagnostics of every watched mode, and of the watch itself where something is amiss.

    Args:
        watch: None before the first model.
        fault: What is wrong with the watch itself.
        stamp_ns: Now [ns].
    """
    msg = DiagnosticArray()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    if said := _said_of_watch(watch, fault):
        msg.status.append(_status("watch", DiagnosticStatus.WARN, said, {}))
    if watch is not None:
        msg.status += [_of_mode(watch, mode) for mode in watch.modes]
    return msg


def drift_from_msg(msg: DiagnosticArray) -> tuple[ToldMode, ...]:
    """Return the modes of diagnostics; statuses of others are left out."""
    found = []
    for status in msg.status:
        values = {pair.key: pair.value for pair in status.values}
        if status.name.startswith(PREFIX) and set(_KEYS) <= set(values):
            numbers = tuple(float(values[key]) for key in _KEYS)
            name = status.name.removeprefix(PREFIX)
            found.append(ToldMode(name, status.level != DiagnosticStatus.OK, status.message, numbers))
    return tuple(found)


def _said_of_watch(watch: DriftWatch | None, fault: str) -> str:
    """Return what is wrong with the watch or with its sensors; empty when nothing is."""
    if watch is None:
        return fault or "no model yet"
    return "; ".join(said for said in (fault, watch.said_of_sensors) if said)


def _numbers(mode: ModeNow) -> tuple[float, ...]:
    return mode.described_hz, mode.f_hz, mode.f_sigma_hz, mode.described_zeta, mode.zeta, mode.zeta_sigma


def _of_mode(watch: DriftWatch, mode: ModeNow) -> DiagnosticStatus:
    """Return a mode; the proposal is among the values of one that has drifted."""
    has_drifted = mode.name in watch.alarms
    level = DiagnosticStatus.WARN if has_drifted else DiagnosticStatus.OK
    values = dict(zip(_KEYS, (f"{value:.6g}" for value in _numbers(mode)), strict=True))
    if has_drifted:
        values[_PROPOSAL] = watch.proposal
    return _status(mode.name, level, watch.said_of(mode), values)


def _status(name: str, level: bytes, text: str, values: dict[str, str]) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticStatus(name=f"{PREFIX}{name}", hardware_id=name, level=level, message=text, values=pairs)
