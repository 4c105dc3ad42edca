"""Bodies that rest bent: their shapes are of second order at most, and hold only so far.

Where the furthest turn of a node against the body's own frame is ``t`` [rad], what they leave out changes
frequencies by some ``t^2``: of a tapered beam with a load at its thin end by -0.4 ``t^2`` in the slowest mode
where the root is held, and by 1.4 ``t^2`` where the load hangs on the root, for then the frame turns with
what turns most (``test_bent_frequencies.py``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

NOTED = 0.1  # rad: from here on a frequency may be off by 1 % and more


def describe_bent(tree: ReducedTree, q: Array) -> tuple[str, ...]:
    """Return a sentence that names the bodies that rest noticeably bent; none if there is none.

    Args:
        tree: The arm.
        q: Its coordinates at rest, (n_q,).
    """
    turns = {name: turn for name, turn in turns_at_rest(tree, q).items() if turn >= NOTED}
    if not turns:
        return ()
    return (
        "rests bent, a node turned against the frame of its body: "
        f"{', '.join(f'{name} {turn:.2f} rad' for name, turn in turns.items())}; frequencies may be "
        "off by 1 % and more; let what holds a beam hold its root, or describe it as several welded together",
    )


def turns_at_rest(tree: ReducedTree, q: Array) -> dict[str, float]:
    """Return how far a node of every body is turned against its own frame [rad], the largest angle by name.

    Args:
        tree: The arm.
        q: Its coordinates, (n_q,).
    """
    found = {}
    for name, body in tree.bodies.items():
        at = tree.elastic_coordinates(name)
        found[name] = float(abs(body.turns @ q[at.start : at.stop]).max(initial=0.0))
    return found
