"""What is wanted of the margins, and the path that is furthest from it.

Wanted of every mode are 6 dB, a factor of two, the smallest gain margin called reasonable in [Astrom2008,
section 9.3], and half a control period of delay: the latency from sensor to torque is compensated in whole
periods, so half of one is what the compensation may be wrong by. Of all torques at once 2 dB are wanted:
other than a mode's shape, a motor constant can be measured, and is rarely off by a fifth. With frequencies
off by up to ``frequency_off`` half of each must be left.

Of a law that acts for a short time only it is wanted that no vibration grows in that time by more than
``firm_growth``, with any of these frequencies: a factor of two again.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass

from flexarm_controller.margins.case import ALL_TORQUES, Case, Margin
from flexarm_controller.margins.short_law import ShortCase
from flexarm_controller.settings import MarginConfig
from flexarm_model.manipulator.description import ManipulatorConfig

MS, PERCENT = 1e3, 100.0
DRIFT = 1e-3  # 1/s, Hz: slower growth is no instability, but an axis whose position no prompt sensor tells


@dataclass(frozen=True)
class Shortfall:
    """A path that is not good enough in a case.

    Attributes:
        case: Pose and frequency error.
        name: Mode, or all torques.
        share: Of what is wanted that is there [1]; below zero when the loop is unstable.
        text: What was found, and what was wanted.
    """

    case: Case
    name: str
    share: float
    text: str


def frequency_errors(config: MarginConfig) -> tuple[float, ...]:
    """Return the errors that are looked at [1]: none, the largest either way, and half of it."""
    return tuple(config.frequency_off * part for part in (-1.0, -0.5, 0.0, 0.5, 1.0))


def shortfalls(cases: Iterable[Case], config: MarginConfig, dt: float) -> list[Shortfall]:
    """Return everything that falls short, the worst first; ``dt`` is the control period [s]."""
    found = [item for case in cases for item in _of_case(case, config, dt)]
    return sorted(found, key=lambda item: item.share)


def verdict(
    cases: Sequence[Case], config: MarginConfig, dt: float, served: Container[str], law: str = "mpc"
) -> str:
    """Return why the arm must not move, naming the mode and what helps; empty when it may.

    Args:
        cases: Every frequency error.
        config: What is wanted.
        dt: Control period [s].
        served: Names of the modes that the controller knows.
        law: Whose settings may help.
    """
    found = shortfalls(cases, config, dt)
    if not found:
        return ""
    case, others = found[0].case, len({item.name for item in found}) - 1
    more = f" (and {others} more)" if others else ""
    pose = ", ".join(f"{value:.4g}" for value in case.pose)
    at = f"{spoken_error(case.frequency_error)}, pose ({pose})"
    return f"margins: {found[0].text}, {at}{more}{_remedy(found[0].name, served, law)}"


def firm_shortfalls(cases: Iterable[ShortCase], config: MarginConfig) -> list[tuple[float, ShortCase, str]]:
    """Return what a firm law lets grow too much, the worst first: factor, where, and in words."""
    found = []
    for case in cases:
        grown = f"{spoken(case.mode)} grows by {case.growth:.3g} at {case.frequency:.3g} Hz"
        factors = [(case.growth, grown)]
        factors += [
            (factor, f"{spoken(name)}, once kicked, shakes the arm {factor:.3g} times as much")
            for name, factor in case.kicked.items()
        ]
        found += [(factor, case, text) for factor, text in factors if not factor <= config.firm_growth]
    return sorted(found, key=lambda item: -item[0])


def firm_verdict(cases: Iterable[ShortCase], config: MarginConfig) -> str:
    """Return why the arm must not move under its firm law, naming the mode; empty when it may."""
    found = firm_shortfalls(cases, config)
    if not found:
        return ""
    _, case, text = found[0]
    pose = ", ".join(f"{value:.4g}" for value in case.pose)
    return (
        f"margins: firm law: {text} within {case.lasts:.3g} s, {config.firm_growth:.3g} is allowed, "
        f"{spoken_error(case.frequency_error)}, pose ({pose}); a shorter mpc.firm_time, a smaller firmness?"
    )


def unread(arm: ManipulatorConfig) -> str:
    """Return which motors have no encoder, to be said after what falls short; empty when all have."""
    read = {sensor.site for sensor in arm.sensors if sensor.kind == "encoder"}
    axes = ", ".join(name for name in arm.actuated if name not in read)
    return f"; no encoder reads {axes}: mount one, cameras come too late" if axes else ""


def wanted_gain_db(name: str, case: Case, config: MarginConfig) -> float:
    """Return the gain margin wanted of a path [dB]."""
    full = config.torque_gain_margin_db if name == ALL_TORQUES else config.gain_margin_db
    return full * _share(case, config)


def wanted_delay(case: Case, config: MarginConfig, dt: float) -> float:
    """Return the delay margin wanted [s]."""
    return config.delay_margin_periods * dt * _share(case, config)


def spoken(name: str) -> str:
    """Return a mode's name for people: "mode 2"."""
    return name.replace("_", " ")


def spoken_error(frequency_error: float) -> str:
    """Return how far the frequencies are off, for people."""
    return f"frequencies {frequency_error * PERCENT:+.0f} %" if frequency_error else "as described"


def _remedy(name: str, served: Container[str], law: str) -> str:
    """Return what helps a mode, as docs/margins.md has it, or joint PD; nothing is known for other paths."""
    is_mode = name.startswith("mode")
    if law == "pd" and (name in served or not is_mode):
        return "; joint PD: another controller.pd_bandwidth or controller.pd_damping, or law mpc?"
    if not is_mode:
        return ""
    if name in served:
        return f"; {spoken(name)} is served: a larger mpc.modal_energy, fewer estimator.stiffness_modes?"
    return (
        f"; {spoken(name)} is not served: a larger estimator.strain_error, estimator.acceleration_error? "
        "see docs/margins.md"
    )


def _share(case: Case, config: MarginConfig) -> float:
    return config.off_share if case.frequency_error else 1.0


def _of_case(case: Case, config: MarginConfig, dt: float) -> list[Shortfall]:
    if not case.is_stable:
        return [Shortfall(case, case.mode, -max(case.growth, 0.0), _unstable(case))]
    return [item for margin in case.margins for item in _of_margin(margin, case, config, dt)]


def _unstable(case: Case) -> str:
    if case.mode.startswith("mode"):
        return (
            f"{spoken(case.mode)} is unstable, it grows by {case.growth:.3g} 1/s at {case.frequency:.3g} Hz"
        )
    if max(case.growth, case.frequency) < DRIFT:
        return "the axes drift: no sensor that speaks in every period tells where they stand"
    return f"the axes are unstable, they grow by {case.growth:.3g} 1/s at {case.frequency:.3g} Hz"


def _of_margin(margin: Margin, case: Case, config: MarginConfig, dt: float) -> list[Shortfall]:
    at = f" ({margin.frequency:.3g} Hz)" if margin.frequency else ""
    name, found = spoken(margin.name) + at, []
    gain, least = margin.gain.decibels, wanted_gain_db(margin.name, case, config)
    if gain < least:
        text = f"gain margin of {name} {gain:.2g} dB, {least:.2g} dB wanted"
        found.append(Shortfall(case, margin.name, gain / least, text))
    delay, least = margin.delay, wanted_delay(case, config, dt)
    if delay < least and not math.isclose(delay, least):
        text = f"delay margin of {name} {delay * MS:.2g} ms, {least * MS:.2g} ms wanted"
        found.append(Shortfall(case, margin.name, delay / least, text))
    return found
