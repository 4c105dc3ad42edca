"""Is every channel what the description says? A verdict in words, before anybody identifies with it.

A quiet stretch tells the noise: half the mean square of differences is blind to slow motion, so second
differences are taken, ``sigma^2 = <(y_k-1 - 2 y_k + y_k+1)^2> / 6``. An arm that is held shakes by the noise
of its encoders, which an accelerometer feels: that much belongs to a sound one. Then every motor pushes once.
What a channel says to that, ``m``, is held against what the model says, ``p``::

    likeness  m'p / |m| |p|        gain  m'p / p'p        both over the pushes of all motors

A channel that resembles another one's prediction better than its own is swapped; one that resembles its own
turned about is flipped.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.noise_floor import noise_floor
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
HEARD = 3.0  # sigmas of noise that the prediction must have to be judged at all
DEAD = 0.1  # share of the predicted answer in a channel that is dead
STILL = 0.3  # share of its size that such a channel moves in any other way, beyond its noise
ALIKE = 0.5  # likeness from which a channel does what the model says
SURE = 0.9  # likeness from which a channel is itself, whoever else speaks as it
BETTER = 0.2  # by which another channel's prediction must be more alike to call it swapped
UNIT = 3.0  # factor from which the size is wrong
NOISY = 3.0  # factor on the described noise
MISSING = 0.2  # share of the samples
AT_THE_STOP = 5  # samples at the same extreme value from which it is a stop

GOOD = "good"
REFUSED = ("silent", "dead", "flipped", "swapped", "clipped")


@dataclass(frozen=True)
class CheckedChannel:
    """What a channel is known by.

    Attributes:
        name: Its name.
        unit: SI.
        sigma: Described noise.
        low, high: Smallest and largest value that it can tell.
        shaken: Standard deviation of the white part of what it tells while the arm is held.
    """

    name: str
    unit: str
    sigma: float
    low: float = -np.inf
    high: float = np.inf
    shaken: float = 0.0

    @property
    def at_rest(self) -> float:
        """Noise of a sound one on an arm that is held."""
        return float(np.hypot(self.sigma, self.shaken))


@dataclass(frozen=True)
class Pushes:
    """What was measured and predicted.

    Attributes:
        quiet: Without any push, (n, c); nan where no sample came.
        rest: Before the push of every motor, (motors, c).
        measured: Deviations from that with the pushes of one motor after another, (motors, n, c).
        predicted: The same from the model, (motors, n, c).
    """

    quiet: Array
    rest: Array
    measured: Array
    predicted: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


@dataclass(frozen=True)
class Finding:
    """What was found of one channel.

    Attributes:
        name: Its name.
        unit: SI.
        noise: Standard deviation at rest.
        described: The same as described, and as the noise of described encoders shakes an arm that is held.
        answers: Root mean square of its answer to the push of every motor, (motors,).
        likeness: To the model's prediction, from -1 to 1; nan when too little is predicted.
        gain: Its size over the predicted one [1].
        verdict: One word of ``REFUSED``, "good", or another doubt.
        words: A sentence.
    """

    name: str
    unit: str
    noise: float
    described: float
    answers: Array
    likeness: float
    gain: float
    verdict: str
    words: str

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)

    @property
    def is_refused(self) -> bool:
        """Whether nothing may be identified with it."""
        return self.verdict in REFUSED


def check_channels(channels: Sequence[CheckedChannel], pushes: Pushes) -> tuple[Finding, ...]:
    """Return a finding per channel, in their order."""
    present = np.isfinite(pushes.measured)
    measured = np.where(present, pushes.measured, 0.0)
    likeness = _likeness(measured, pushes.predicted)
    found = []
    for c, channel in enumerate(channels):
        rivals = [j for j, other in enumerate(channels) if other.unit == channel.unit and j != c]
        noise = noise_floor(pushes.quiet[:, c])
        m, p = measured[:, :, c], pushes.predicted[:, :, c]
        size = float(np.sqrt(np.mean(p**2)))
        gain = float(np.sum(m * p) / np.sum(p**2)) if size else np.nan
        doubts = _Doubts(channel, noise, float(np.sqrt(np.mean(m**2))), size, gain, likeness[c])
        verdict, words = _verdict(doubts, c, rivals, channels, pushes)
        is_judged = size > HEARD * channel.at_rest
        found.append(
            Finding(
                channel.name, channel.unit, noise, channel.at_rest, np.sqrt(np.mean(m**2, axis=1)),
                float(likeness[c, c]) if is_judged else np.nan, gain if is_judged else np.nan, verdict, words,
            )
        )  # fmt: skip
    return tuple(_with_partners(found, channels, likeness))


def _with_partners(
    found: Sequence[Finding], channels: Sequence[CheckedChannel], likeness: Array
) -> Iterator[Finding]:
    """Yield the findings, with channels in doubt for which another one speaks: a swap takes two."""
    for c, finding in enumerate(found):
        spoken_for = [
            other.name
            for j, other in enumerate(found)
            if other.verdict == "swapped" and _rival(j, channels, likeness) == c
        ]
        if spoken_for and not finding.is_refused and not finding.likeness > SURE:
            words = f"{spoken_for[0]} speaks for it (own likeness {finding.likeness:+.2f})"
            yield replace(finding, verdict="swapped", words=words)
        else:
            yield finding


def _rival(c: int, channels: Sequence[CheckedChannel], likeness: Array) -> int:
    """Return the other channel of its unit that a channel resembles most."""
    rivals = [j for j, other in enumerate(channels) if other.unit == channels[c].unit and j != c]
    return max(rivals, key=lambda j: abs(likeness[c, j]), default=c)


@dataclass(frozen=True)
class _Doubts:
    """Numbers of one channel: see ``Finding``; ``size`` is the prediction's, ``answer`` the channel's."""

    channel: CheckedChannel
    noise: float
    answer: float
    size: float
    gain: float
    likeness: Array  # to every prediction, (c,)

    @property
    def moved(self) -> float:
        """What of its answer is more than its noise."""
        return float(np.sqrt(max(self.answer**2 - np.nan_to_num(self.noise) ** 2, 0.0)))


def _verdict(
    at: _Doubts, c: int, rivals: Sequence[int], channels: Sequence[CheckedChannel], pushes: Pushes
) -> tuple[str, str]:
    pushed = pushes.measured[:, :, c] + pushes.rest[:, c, None]
    record = np.concatenate([pushes.quiet[:, c], pushed.ravel()])
    missing = float(np.mean(~np.isfinite(record)))
    if missing > MISSING:
        return "silent", f"{100 * missing:.0f} % of its samples did not come"
    if not at.noise > 0.0 and at.answer == 0.0:
        return "dead", "says the same number all the time"
    if _is_clipped(record, at.channel):
        return "clipped", f"stays at {np.nanmax(abs(record)):.3g} {at.channel.unit} as if at a stop"
    if at.size > HEARD * at.channel.at_rest:
        return _against_model(at, c, rivals, channels)
    if at.noise > NOISY * at.channel.at_rest:
        return _noisy(at)
    return "not moved", "no push moves it beyond its noise: sign and place are not known"


def _against_model(
    at: _Doubts, c: int, rivals: Sequence[int], channels: Sequence[CheckedChannel]
) -> tuple[str, str]:
    """Return the verdict on a channel that the pushes should move: the first doubt of the list that holds."""
    own = float(at.likeness[c])
    best = max(rivals, key=lambda j: abs(at.likeness[j]), default=c)
    other = float(at.likeness[best])
    sign = " turned about" if other < 0 else ""
    quiet = f"answers with {100 * at.moved / at.size:.1f} % of what the model says"
    as_other = f"speaks as {channels[best].name}{sign} should ({other:+.2f}, own {own:+.2f})"
    is_noisy = at.noise > NOISY * at.channel.at_rest
    doubts = [
        (is_noisy and at.answer < NOISY * at.noise, *_noisy(at)),
        (abs(at.gain) < DEAD and at.moved < STILL * at.size, "dead", quiet),
        (abs(other) > max(abs(own) + BETTER, ALIKE), "swapped", as_other),
        (own < -ALIKE, "flipped", f"its sign is the opposite of the model's (likeness {own:+.2f})"),
        (own < ALIKE, "unlike", f"moves, but not as the model says (likeness {own:+.2f})"),
        (not 1 / UNIT < at.gain < UNIT, "wrong size", f"{at.gain:.3g} times the model's answer: unit?"),
        (is_noisy, *_noisy(at)),
    ]
    good = f"sign, size and place as the model says (likeness {own:+.2f})"
    return next(((verdict, words) for holds, verdict, words in doubts if holds), (GOOD, good))


def _noisy(at: _Doubts) -> tuple[str, str]:
    return "noisy", f"{at.noise / at.channel.at_rest:.1f} times the described noise"


def _likeness(measured: Array, predicted: Array) -> Array:
    """Return the cosine of every measured channel to every predicted one, (c, c)."""
    count = measured.shape[2]
    m, p = measured.reshape(-1, count), predicted.reshape(-1, count)
    sizes = np.outer(np.linalg.norm(m, axis=0), np.linalg.norm(p, axis=0))
    return np.asarray(m.T @ p / np.maximum(sizes, np.finfo(float).tiny))


def _is_clipped(record: Array, channel: CheckedChannel) -> bool:
    known = record[np.isfinite(record)]
    if known.size == 0 or np.ptp(known) == 0.0:
        return False
    outside = ((known <= channel.low) | (known >= channel.high)).any()
    stuck = max(np.count_nonzero(known == known.max()), np.count_nonzero(known == known.min()))
    return bool(outside or stuck >= AT_THE_STOP)
