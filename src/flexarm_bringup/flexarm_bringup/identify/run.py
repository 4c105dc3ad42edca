"""A measurement identified: modes, their uncertainty both ways, simpler methods and the model beside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Responses
from flexarm_bringup.identify.sources import Source
from flexarm_model.config import load_config
from flexarm_model.identification.automatic import Identified, identify_modes, orders_for
from flexarm_model.identification.bootstrap import Scatter, bootstrap
from flexarm_model.identification.lscf import poles_of_orders
from flexarm_model.identification.stabilisation import lasting
from flexarm_model.linearize import linearize
from flexarm_model.manipulator_file import find_manipulator
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.half_power import HalfPower, half_power
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]
DRAWS = 20  # of the bootstrap
MOST_INPUTS = 6  # on the smaller side of the matrix; each more multiplies the poles


@dataclass(frozen=True)
class Request:
    """What was asked.

    Attributes:
        band_hz: Band of the modes [Hz]; None takes all lines but 0 Hz.
        coherence: Lines below it do not count [1].
        manipulator: Name or file of a manipulator to compare with; empty for none.
        preset: Its preset.
    """

    band_hz: tuple[float, float] | None
    coherence: float
    manipulator: str = ""
    preset: str = ""


@dataclass(frozen=True)
class Result:
    """Everything that the page shows.

    Attributes:
        responses: What was measured.
        frf: The matrix in the band, outputs by inputs.
        is_reciprocal: The fit took outputs for inputs, since there are fewer of them.
        weight: 1 for lines that count, (k,).
        found: The modes.
        scatter: By bootstrap over blocks; None without records.
        half_power: Per mode by half-power on the largest response; None where it fails.
        single_hz: Frequencies that one input alone gives through the chart, without refinement [Hz].
        model_hz: Frequencies of the manipulator's served model [Hz]; empty without one.
        is_windowed: The responses come from records, behind a window.
    """

    responses: Responses
    frf: Frf
    is_reciprocal: bool
    weight: Array
    found: Identified
    scatter: Scatter | None
    half_power: tuple[HalfPower | None, ...]
    single_hz: tuple[float, ...]
    model_hz: tuple[float, ...]
    is_windowed: bool


def identify(source: Source, request: Request, estimator: str) -> Result:
    """Return the modes of a source.

    Raises:
        ValueError: Responses are missing, the band holds too few lines, or the manipulator is unknown.
    """
    whole = source.responses.matrix()
    low, high = request.band_hz or (float(whole.f_hz[1]), float(whole.f_hz[-1]))
    inside = (whole.f_hz >= low) & (whole.f_hz <= high)
    frf, weight = whole.band(low, high), source.responses.weight(request.coherence)[inside]
    is_reciprocal = frf.H.shape[1] < frf.H.shape[2]
    fitted = frf.transposed() if is_reciprocal else frf
    if fitted.H.shape[2] > MOST_INPUTS:
        raise ValueError(f"{fitted.H.shape[2]} references; at most {MOST_INPUTS} can be fitted at once")
    found = identify_modes(fitted, weight)
    blocks, fit = source.blocks, found.fit
    scatter = None
    if blocks is not None and fit is not None and not is_reciprocal:
        scatter = bootstrap(blocks, fit, estimator, (low, high), DRAWS)
    frequencies = tuple(map(float, fit.model.f_hz)) if fit else ()
    return Result(
        source.responses, frf, is_reciprocal, weight, found, scatter,
        tuple(_half_power(frf, f_hz) for f_hz in frequencies),
        _single(fitted), _model(request), blocks is not None,
    )  # fmt: skip


def _half_power(frf: Frf, f_hz: float) -> HalfPower | None:
    line = int(abs(frf.f_hz - f_hz).argmin())
    o, i = np.unravel_index(abs(frf.H[line]).argmax(), frf.H.shape[1:])
    receptance = abs(frf.H[:, o, i]) / abs(frf.s) ** frf.power
    try:
        return half_power(frf.f_hz, receptance, f_hz)
    except ValueError:
        return None


def _single(frf: Frf) -> tuple[float, ...]:
    one = Frf(frf.f_hz, frf.H[:, :, :1], frf.kind)
    chart = poles_of_orders(one, orders_for(one))
    return tuple(float(abs(track.pole)) / (2 * np.pi) for track in lasting(chart))


def _model(request: Request) -> tuple[float, ...]:
    if not request.manipulator:
        return ()
    config = load_config(find_manipulator(request.manipulator), request.preset)
    return tuple(float(value) for value in linearize(ReducedTree(config)).omega / (2 * np.pi))
