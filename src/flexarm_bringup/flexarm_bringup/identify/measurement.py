"""What a source gives: frequency responses, or records of inputs and outputs, with names.

Several set-ups (roving sensors, roving hammer, several references) are cells of one matrix; merging them
puts every response where it belongs and says which are missing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Cell = tuple[str, str]  # output, input
COMMON = "receptance"  # kind of outputs that do not say another one
KIND_OF_UNIT = {"m/s^2": "accelerance"}  # of displacements as any other output is
LEFT_OUT = ("rad/s",)  # gyroscopes: a quarter of a period off the others, no real shape holds both
SAME_LINE = 1e-6  # relative distance of lines that are the same
ROUNDED = 0.01  # by which a coherence may be more than 1


class SourceError(ValueError):
    """A source cannot be used; the message names the file and what is wrong with it."""


@dataclass(frozen=True)
class Responses:
    """Measured cells of an FRF matrix.

    Attributes:
        f_hz: Lines of all cells [Hz], (k,).
        cells: Response per (output, input), (k,) each.
        coherence: Per cell where it is known, (k,).
        kind: What an output is of a displacement.
        kinds: The same of single outputs that differ; such a matrix is of "receptance" in name only.
        band_hz: Where the inputs had power [Hz]; None when nobody knows.
    """

    f_hz: Array
    cells: Mapping[Cell, Complex]
    coherence: Mapping[Cell, Array]
    kind: str
    kinds: Mapping[str, str] = field(default_factory=dict)
    band_hz: tuple[float, float] | None = None

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs, in the order in which they were found."""
        return tuple(dict.fromkeys(cell[0] for cell in self.cells))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs, in the order in which they were found."""
        return tuple(dict.fromkeys(cell[1] for cell in self.cells))

    def matrix(self) -> Frf:
        """Return the full matrix, outputs by inputs.

        Raises:
            SourceError: A cell is missing, or not finite on some lines; names it.
        """
        missing = [(o, i) for o in self.outputs for i in self.inputs if (o, i) not in self.cells]
        if missing:
            named = ", ".join(f"{o}/{i}" for o, i in missing[:5])
            raise SourceError(
                f"{len(missing)} of {len(self.outputs) * len(self.inputs)} responses are missing "
                f"(output/input): {named}; a matrix of {len(self.outputs)} outputs and "
                f"{len(self.inputs)} inputs needs all of them"
            )
        gaps = {cell: int(np.sum(~np.isfinite(values))) for cell, values in self.cells.items()}
        told = [f"{count} of {self.f_hz.size} lines of {o}/{i}" for (o, i), count in gaps.items() if count]
        if told:
            raise SourceError(
                f"not finite: {', '.join(told)}; repair them, or leave an output out with --ignore-channel"
            )
        rows = [[self.cells[o, i] for i in self.inputs] for o in self.outputs]
        return Frf(self.f_hz, np.asarray(np.array(rows).transpose(2, 0, 1)), self.kind)

    def weight(self, least: float) -> Array:
        """Return 1 where every known coherence of an output is at least ``least``, else 0, (k, n_out)."""
        outputs = self.outputs
        weight = np.ones((self.f_hz.size, len(outputs)))
        for (output, _), coherence in self.coherence.items():
            weight[~(coherence >= least), outputs.index(output)] = 0.0
        return weight

    def without(self, outputs: Sequence[str]) -> Responses:
        """Return the responses of the other outputs.

        Raises:
            SourceError: None would be left.
        """
        cells = {cell: value for cell, value in self.cells.items() if cell[0] not in outputs}
        if not cells:
            raise SourceError(f"no output is left without {', '.join(outputs)}")
        coherence = {cell: value for cell, value in self.coherence.items() if cell[0] not in outputs}
        return replace(self, cells=cells, coherence=coherence)


@dataclass(frozen=True)
class Records:
    """Records in time, evenly sampled.

    Attributes:
        rate_hz: Samples per second [Hz].
        inputs: By name, (samples,).
        outputs: By name, (samples,).
        kind: What an output is of a displacement.
        kinds: The same of single outputs that differ.
        instruments: What was asked of every input before feedback changed it, by its name, (samples,).
        repeats: Samples after which the excitation repeats; 0 when it does not.
        is_held: An input stays until the next sample, as a drive's torque does.
        band_hz: Where the inputs have power [Hz]; None when nobody knows.
        remarks: What the reader should know of it.
        is_centred: Outputs are told without their mean.
        file: Name of the file or bag that they come from; empty where there is none.
        is_of_moves: Nobody excited the arm on purpose: its controller moved it, so inputs answer to outputs.
    """

    rate_hz: float
    inputs: Mapping[str, Array]
    outputs: Mapping[str, Array]
    kind: str
    kinds: Mapping[str, str] = field(default_factory=dict)
    instruments: Mapping[str, Array] = field(default_factory=dict)
    repeats: int = 0
    is_held: bool = False
    band_hz: tuple[float, float] | None = None
    remarks: tuple[str, ...] = ()
    is_centred: bool = False
    file: str = ""
    is_of_moves: bool = False


def checked(path: Path, responses: Responses) -> Responses:
    """Return the responses of a file.

    Raises:
        SourceError: Its lines do not ascend from 0 Hz or above, or a coherence has no response, or is none.
    """
    f_hz = responses.f_hz
    if not (np.isfinite(f_hz).all() and (f_hz[:1] >= 0.0).all() and (np.diff(f_hz) > 0.0).all()):
        raise SourceError(f"{path}: its lines are not frequencies that ascend from 0 Hz or above")
    alone = [f"{output}/{source}" for output, source in responses.coherence.keys() - responses.cells.keys()]
    if alone:
        raise SourceError(f"{path}: a coherence, but no response of {', '.join(sorted(alone))}")
    for (output, source), value in responses.coherence.items():
        known = value[np.isfinite(value)]
        if ((known < -ROUNDED) | (known > 1.0 + ROUNDED)).any():
            raise SourceError(
                f"{path}: the coherence of {output}/{source} goes from {known.min():.4g} to "
                f"{known.max():.4g}; expected 0 to 1"
            )
    return responses


def merge(parts: Sequence[Responses]) -> Responses:
    """Return the cells of all set-ups together; one measured twice is averaged.

    Raises:
        SourceError: Lines or kinds differ.
    """
    first = parts[0]
    for part in parts[1:]:
        if part.kind != first.kind:
            raise SourceError(f"set-ups differ: {first.kind} and {part.kind}")
        if part.f_hz.shape != first.f_hz.shape or not np.allclose(part.f_hz, first.f_hz, rtol=SAME_LINE):
            raise SourceError(
                f"set-ups have different lines: {first.f_hz.size} up to {first.f_hz[-1]:g} Hz and "
                f"{part.f_hz.size} up to {part.f_hz[-1]:g} Hz"
            )
    every = dict.fromkeys(cell for part in parts for cell in part.cells)
    cells = {
        cell: np.asarray(np.mean([part.cells[cell] for part in parts if cell in part.cells], axis=0))
        for cell in every
    }
    known = dict.fromkeys(cell for part in parts for cell in part.coherence)
    coherence: dict[Cell, Array] = {
        cell: np.asarray(np.min([part.coherence[cell] for part in parts if cell in part.coherence], axis=0))
        for cell in known
    }
    kinds = {output: kind for part in parts for output, kind in part.kinds.items()}
    return Responses(first.f_hz, cells, coherence, first.kind, kinds, first.band_hz)


def known_outputs(outputs: Sequence[str], names: Sequence[str], among: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the outputs that names stand for: of a channel, or of a sensor with all its channels.

    Args:
        outputs: That were measured.
        names: To look for.
        among: More names that are known, of outputs that are left out already.

    Raises:
        SourceError: A name stands for none.
    """
    known = {*outputs, *(output.partition(".")[0] for output in outputs), *among}
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SourceError(f"--ignore-channel {', '.join(unknown)}: not one of {', '.join(outputs)}")
    return tuple(o for o in outputs if o in names or o.partition(".")[0] in names)
