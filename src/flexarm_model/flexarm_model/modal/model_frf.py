"""Frequency responses of a served model, as its sensors give them.

An input is a motor's torque or a force along what an output row measures (a hammer at the
accelerometer, a push at the tool). By virtual work the force's column is the row's transpose.
An output is all that its row reads, ``C_pos + s C_vel + s^2 C_acc``: an accelerometer feels gravity as it
tilts, too, which at 1 Hz may be more than its acceleration.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.frf import KINDS, Frf, Ports, exact_frf
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


def row_index(model: ReducedModel, name: str) -> int:
    """Return the index of the output row "sensor.channel".

    Raises:
        KeyError: There is none; the message lists those that exist.
    """
    if name not in model.outputs.names:
        raise KeyError(f"no output row '{name}'; known: {', '.join(model.outputs.names)}")
    return model.outputs.names.index(name)


def displacement_row(model: ReducedModel, name: str) -> Array:
    """Return the displacement whose derivative a row measures: an accelerometer's second one, (n,)."""
    i = row_index(model, name)
    return np.asarray(_parts(model)[_kind(model, i)][i])


def input_column(model: ReducedModel, name: str) -> Array:
    """Return the force on ``xi`` per unit input, (n,): an actuated axis, or a row to push along."""
    if name in model.theta_names:
        return model.B[:, model.theta_names.index(name)]
    return displacement_row(model, name)


def model_frf(
    model: ReducedModel, f_hz: Array, outputs: Sequence[str], inputs: Sequence[str], locked: bool = True
) -> Frf:
    """Return what sensor rows read: accelerometers give accelerance, gyroscopes mobility, others receptance.

    Args:
        model: The served model.
        f_hz: Lines [Hz], (k,).
        outputs: Rows "sensor.channel", all of one kind.
        inputs: Actuated axes or rows to push along.
        locked: Actuated axes held, or free.

    Raises:
        KeyError: A row does not exist.
        ValueError: Kinds of responses are mixed, or the torque of a locked axis is asked for.
    """
    rows = [row_index(model, name) for name in outputs]
    kinds = {_kind(model, i) for i in rows}
    if len(kinds) != 1:
        raise ValueError(
            f"rows have responses of different kinds, {', '.join(sorted(kinds))}; ask for each separately"
        )
    torques = [name for name in inputs if name in model.theta_names]
    if locked and torques:
        raise ValueError(f"a locked axis takes its torque itself: {', '.join(torques)}")
    kept = slice(model.n_theta if locked else 0, model.n)
    matrices = model.M[kept, kept], model.D[kept, kept], model.K[kept, kept]
    B = np.column_stack([input_column(model, name) for name in inputs])[kept]
    read = [(kind, part[rows, kept]) for kind, part in _parts(model).items()]
    found = [exact_frf(f_hz, matrices, Ports(B, C), kind) for kind, C in read]
    return Frf(found[0].f_hz, np.sum([frf.H for frf in found], axis=0), kinds.pop())


def _parts(model: ReducedModel) -> dict[str, Array]:
    """Return the rows of every derivative of xi by the kind of response that they give, (n_y, n) each."""
    outputs = model.outputs
    return dict(zip(KINDS, (outputs.C_pos, outputs.C_vel, outputs.C_acc), strict=True))


def _kind(model: ReducedModel, row: int) -> str:
    """Return the kind of a row's response: of its highest derivative."""
    return [kind for kind, part in _parts(model).items() if kind == "receptance" or part[row].any()][-1]
