"""Whether the control rate of a description is fast enough for the modes that are served.

Per period of a mode there are ``n = 2 pi rate / omega`` samples. A law wants five to ten of the fastest mode
that it damps; with less than two of the slowest it can damp none at all (Shannon).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]

LEAST = 2.0  # samples per period of the slowest mode
WANTED = "five to ten wanted of the fastest mode that control damps"


def samples_per_period(rate_hz: float, omega: Array) -> Array:
    """Return how often the law acts within a period of each mode, (n_eta,).

    Args:
        rate_hz: Control rate [Hz].
        omega: Of the modes [rad/s], (n_eta,).
    """
    return np.asarray(2 * np.pi * rate_hz / omega)


def describe_rate(rate_hz: float, omega: Array) -> tuple[str, ...]:
    """Return the sentence about a rate and the slowest and the fastest mode; none without modes.

    Args:
        rate_hz: Control rate [Hz].
        omega: Of the modes, ascending [rad/s], (n_eta,).
    """
    if not omega.size:
        return ()
    n = samples_per_period(rate_hz, omega)
    ends = dict.fromkeys((0, omega.size - 1))  # one where there is one mode
    told = ", ".join(f"{n[k]:.3g} samples per period of mode {k + 1}" for k in ends)
    return (f"rate {rate_hz:g} Hz: {told}; {WANTED}",)


def refuse_slow_rate(config: ManipulatorConfig, omega: Array) -> None:
    """Refuse a control rate that cannot follow even the slowest mode.

    Args:
        config: The description; its ``rate_hz`` is judged.
        omega: Of the modes at home, ascending [rad/s], (n_eta,).

    Raises:
        ConfigError: There are less than two samples per period of it.
    """
    for n in samples_per_period(config.rate_hz, omega[:1]):
        if n < LEAST:
            slowest = config.rate_hz / n
            raise ConfigError(
                f"{config.name}: served.rate: {config.rate_hz:g} Hz: {n:.3g} samples per period of mode 1 at "
                f"{slowest:.4g} Hz; expected at least {LEAST * slowest:.4g} Hz, {WANTED}"
            )
