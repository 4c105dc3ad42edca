"""What is known of a channel, what was measured of it, and what is found of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
GOOD = "good"
ANOTHER_ARM = "another arm"
REFUSED = ("silent", "dead", "flipped", "swapped", "clipped", "off at rest", ANOTHER_ARM)


@dataclass(frozen=True)
class CheckedChannel:
    """What a channel is known by.

    Attributes:
        name: Its name.
        unit: SI.
        sigma: Described noise.
        low, high: Smallest and largest value that it can tell.
        shaken: Standard deviation of the white part of what it tells while the arm is held.
        standing: What the model has it tell at rest.
        allowance: By how much a sound one may differ from that.
    """

    name: str
    unit: str
    sigma: float
    low: float = -np.inf
    high: float = np.inf
    shaken: float = 0.0
    standing: float = 0.0
    allowance: float = np.inf

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
        gain: Its size over the predicted one, without its noise [1]; nan as the likeness.
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
