"""Frequency responses of a served model, as its sensors give them.

An input is a motor's torque or a force along what an output row measures (a hammer at the
accelerometer, a push at the tool). By virtual work the force's column is the row's transpose.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf, Ports, exact_frf
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
    """Return the displacement that a row measures (an accelerometer's: its acceleration row), (n,)."""
    i = row_index(model, name)
    acceleration = model.outputs.C_acc[i]
    return np.asarray(acceleration if acceleration.any() else model.outputs.C_pos[i])


def input_column(model: ReducedModel, name: str) -> Array:
    """Return the force on ``xi`` per unit input, (n,): an actuated axis, or a row to push along."""
    if name in model.theta_names:
        return model.B[:, model.theta_names.index(name)]
    return displacement_row(model, name)


def model_frf(
    model: ReducedModel, f_hz: Array, outputs: Sequence[str], inputs: Sequence[str], locked: bool = True
) -> Frf:
    """Return the responses of sensor rows; accelerometers give accelerance, the others receptance.

    Args:
        model: The served model.
        f_hz: Lines [Hz], (k,).
        outputs: Rows "sensor.channel", all of accelerometers or none.
        inputs: Actuated axes or rows to push along.
        locked: Actuated axes held, or free.

    Raises:
        KeyError: A row does not exist.
        ValueError: Accelerometers and others are mixed, or the torque of a locked axis is asked for.
    """
    rows = [row_index(model, name) for name in outputs]
    kinds = {"accelerance" if model.outputs.C_acc[i].any() else "receptance" for i in rows}
    if len(kinds) != 1:
        raise ValueError("accelerometers and other outputs have responses of different kinds; ask separately")
    torques = [name for name in inputs if name in model.theta_names]
    if locked and torques:
        raise ValueError(f"a locked axis takes its torque itself: {', '.join(torques)}")
    kept = slice(model.n_theta if locked else 0, model.n)
    M, D, K = (matrix[kept, kept] for matrix in (model.M, model.D, model.K))
    B = np.column_stack([input_column(model, name) for name in inputs])
    C = np.array([displacement_row(model, name) for name in outputs])
    return exact_frf(f_hz, (M, D, K), Ports(B[kept], C[:, kept]), kinds.pop())
