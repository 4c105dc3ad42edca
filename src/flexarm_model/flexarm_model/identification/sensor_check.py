"""Is every channel what the description says? A verdict in words, before anybody identifies with it.

A quiet stretch tells the noise: half the mean square of differences is blind to slow motion, so second
differences are taken, ``sigma^2 = <(y_k-1 - 2 y_k + y_k+1)^2> / 6``. An arm that is held shakes by the noise
of its encoders, which an accelerometer feels: that much belongs to a sound one. It also tells what a channel
says at rest. Then every motor pushes once. What a channel says to that, ``m``, is held against what the model
says, ``p``::

    likeness  m'p / |m| |p|        size  |m| / |p|        both over the pushes of all motors

A channel that resembles another one's prediction better than its own is swapped; one that resembles its own
turned about is flipped. An arm that is softer or heavier than described answers with another size in every
channel, so a size is held against the median of all: where that is off, no sensor is to blame. What such an
arm does to one channel alone makes it less alike, too, so much less is its size held against it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.channel_findings import (
    ANOTHER_ARM,
    GOOD,
    CheckedChannel,
    Finding,
    Pushes,
)
from flexarm_model.identification.noise_floor import noise_floor
from flexarm_model.identification.swapped_channels import exchanged, likeness, rival

Array = NDArray[np.float64]
HEARD = 3.0  # sigmas of noise that the prediction must have to be judged at all
DEAD = 0.1  # share of the predicted answer in a channel that is dead
STILL = 0.3  # share of its size that such a channel moves in any other way, beyond its noise
ALIKE = 0.5  # likeness from which a channel does what the model says
SURE = 0.9  # likeness from which a channel is itself, whoever else speaks as it
BETTER = 0.2  # by which another channel's prediction must be more alike to call it swapped
UNIT = 1.5  # factor on the usual size from which the size of one that is wholly alike is wrong
NOISY = 3.0  # factor on the described noise
MISSING = 0.2  # share of the samples
AT_THE_STOP = 5  # samples at the same extreme value from which it is a stop


def check_channels(channels: Sequence[CheckedChannel], pushes: Pushes) -> tuple[Finding, ...]:
    """Return a finding per channel, in their order."""
    alike = likeness(np.nan_to_num(pushes.measured), pushes.predicted)
    numbers = [_Numbers.of(c, channel, pushes, alike) for c, channel in enumerate(channels)]
    judged = [c for c, at in enumerate(numbers) if at.is_judged]
    pairs = exchanged(channels, alike, judged)
    sized = [numbers[c].share for c in judged if c not in pairs and numbers[c].has_size]
    check = _Check(channels, pushes, alike, pairs, usual_size(sized))
    found = [_finding(c, at, *_verdict(at, c, check)) for c, at in enumerate(numbers)]
    return tuple(_of_the_arm(tuple(_with_partners(found, check)), numbers))


def usual_size(shares: Sequence[float]) -> float:
    """Return the median of sizes over the model's; of two in the middle the one nearer to the model's."""
    if len(shares) < 2:
        return 1.0  # nobody to be compared with
    ordered = sorted(shares)
    middle = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return float(min(middle, key=lambda share: abs(np.log(share))))


@dataclass(frozen=True)
class _Numbers:
    """Numbers of one channel: see ``Finding``; ``size`` is the prediction's, ``answer`` the channel's."""

    channel: CheckedChannel
    noise: float
    rest: float
    answers: Array  # (motors,)
    size: float
    projected: float  # on the prediction, over its size
    likeness: float

    @classmethod
    def of(cls, c: int, channel: CheckedChannel, pushes: Pushes, alike: Array) -> _Numbers:
        """Return those of channel c."""
        m, p = np.nan_to_num(pushes.measured[:, :, c]), pushes.predicted[:, :, c]
        quiet, size = pushes.quiet[:, c], float(np.sqrt(np.mean(p**2)))
        known = quiet[np.isfinite(quiet)]
        return cls(
            channel, noise_floor(quiet), float(known.mean()) if known.size else np.nan,
            np.sqrt(np.mean(m**2, axis=1)), size,
            float(np.sum(m * p) / np.sum(p**2)) if size else np.nan, float(alike[c, c]),
        )  # fmt: skip

    @property
    def answer(self) -> float:
        """Root mean square of its answer to all pushes."""
        return float(np.sqrt(np.mean(self.answers**2)))

    @property
    def moved(self) -> float:
        """What of its answer is more than its noise."""
        return float(np.sqrt(max(self.answer**2 - np.nan_to_num(self.noise) ** 2, 0.0)))

    @property
    def share(self) -> float:
        """Its answer over the predicted one."""
        return self.moved / self.size

    @property
    def is_judged(self) -> bool:
        """Whether the model predicts enough beyond its noise."""
        return self.size > HEARD * self.channel.at_rest

    @property
    def has_size(self) -> bool:
        """Whether it says enough of its own to be compared by size."""
        return abs(self.likeness) >= ALIKE and self.share > DEAD

    @property
    def is_noisy(self) -> bool:
        """Whether it has far more noise than a sound one."""
        return self.noise > NOISY * self.channel.at_rest


@dataclass(frozen=True)
class _Check:
    """What a verdict looks at beside a channel's own numbers."""

    channels: Sequence[CheckedChannel]
    pushes: Pushes
    alike: Array
    pairs: Mapping[int, int]
    usual: float


def _finding(c: int, at: _Numbers, verdict: str, words: str) -> Finding:
    likeness, share = (at.likeness, at.share) if at.is_judged else (np.nan, np.nan)
    channel = at.channel
    return Finding(
        channel.name, channel.unit, at.noise, channel.at_rest, at.answers, likeness, share, verdict, words
    )


def _verdict(at: _Numbers, c: int, check: _Check) -> tuple[str, str]:
    pushes = check.pushes
    pushed = pushes.measured[:, :, c] + pushes.rest[:, c, None]
    record = np.concatenate([pushes.quiet[:, c], pushed.ravel()])
    missing = float(np.mean(~np.isfinite(record)))
    off = abs(at.rest - at.channel.standing) > at.channel.allowance
    doubts = [
        (missing > MISSING, "silent", f"{100 * missing:.0f} % of its samples did not come"),
        (not at.noise > 0.0 and at.answer == 0.0, "dead", "says the same number all the time"),
        (_is_clipped(record, at.channel), "clipped", _stop(record, at.channel)),
        *(_against_model(at, c, check) if at.is_judged else []),
        (off, "off at rest", _standing(at)),
        (at.is_noisy, *_noisy(at)),
        (not at.is_judged, "not moved", "no push moves it beyond its noise: sign and place are not known"),
    ]
    good = f"sign, size and place as the model says (likeness {at.likeness:+.2f})"
    return next(((verdict, words) for holds, verdict, words in doubts if holds), (GOOD, good))


def _against_model(at: _Numbers, c: int, check: _Check) -> list[tuple[bool, str, str]]:
    """Return doubts of a channel that the pushes should move: the first that holds counts."""
    own, other = at.likeness, check.pairs.get(c, rival(c, check.channels, check.alike))
    its = float(check.alike[c, other])
    sign = " turned about" if its < 0 else ""
    as_other = f"speaks as {check.channels[other].name}{sign} should ({its:+.2f}, own {own:+.2f})"
    is_swapped = c in check.pairs or abs(its) > max(abs(own) + BETTER, ALIKE)
    bound = UNIT / np.sqrt(max(own, ALIKE))
    among = f"{at.share:.3g} times the model's answer, where the others have {check.usual:.3g}: factor, unit?"
    together = (
        f"all channels answer {check.usual:.3g} times as the model says: torque, gear, masses or preset"
    )
    return [
        (at.is_noisy and at.answer < NOISY * at.noise, *_noisy(at)),
        (abs(at.projected) < DEAD and at.moved < STILL * at.size, "dead", _weak(at.share)),
        (is_swapped, "swapped", as_other),
        (own < -ALIKE, "flipped", f"its sign is the opposite of the model's (likeness {own:+.2f})"),
        (own < ALIKE, "unlike", f"moves, but not as the model says (likeness {own:+.2f})"),
        (not 1 / bound < at.share / check.usual < bound, "wrong size", among),
        (not 1 / UNIT < check.usual < UNIT, "wrong size", together),
    ]


def _with_partners(found: Sequence[Finding], check: _Check) -> Iterator[Finding]:
    """Yield the findings, with channels in doubt for which another one speaks: a swap takes two."""
    for c, finding in enumerate(found):
        spoken_for = [
            other.name
            for j, other in enumerate(found)
            if other.verdict == "swapped" and rival(j, check.channels, check.alike) == c
        ]
        if spoken_for and not finding.is_refused and not finding.likeness > SURE:
            words = f"{spoken_for[0]} speaks for it (own likeness {finding.likeness:+.2f})"
            yield replace(finding, verdict="swapped", words=words)
        else:
            yield finding


def _of_the_arm(found: Sequence[Finding], numbers: Sequence[_Numbers]) -> Iterator[Finding]:
    """Yield the findings; where all channels that should move do not, it is the arm and not its sensors."""
    judged = [at for at in numbers if at.is_judged]
    still = [f for f, at in zip(found, numbers, strict=True) if at.is_judged and f.verdict == "dead"]
    is_arm = len(judged) > 1 and len(still) == len(judged) and all(at.answer > 0.0 for at in judged)
    words = "the whole arm answers with {:.2g} % of what the model says: preset, description or torque"
    for finding in found:
        if is_arm and finding in still:
            share = 100 * float(np.median([at.share for at in judged]))
            yield replace(finding, verdict=ANOTHER_ARM, words=words.format(share))
        else:
            yield finding


def _noisy(at: _Numbers) -> tuple[str, str]:
    return "noisy", f"{at.noise / at.channel.at_rest:.1f} times the described noise"


def _weak(share: float) -> str:
    return f"answers with {100 * share:.1f} % of what the model says"


def _stop(record: Array, channel: CheckedChannel) -> str:
    return f"stays at {np.nanmax(abs(record), initial=0.0):.3g} {channel.unit} as if at a stop"


def _standing(at: _Numbers) -> str:
    said = f"says {at.rest:.2f} {at.channel.unit} at rest and the model {at.channel.standing:.2f}"
    return f"{said}: its mounting, or gravity in the description"


def _is_clipped(record: Array, channel: CheckedChannel) -> bool:
    known = record[np.isfinite(record)]
    if known.size == 0 or np.ptp(known) == 0.0:
        return False
    outside = ((known <= channel.low) | (known >= channel.high)).any()
    stuck = max(np.count_nonzero(known == known.max()), np.count_nonzero(known == known.min()))
    return bool(outside or stuck >= AT_THE_STOP)
