"""A measurement identified: modes, their uncertainty, simpler methods and the model beside.

Outputs may differ in kind and in unit. Every output is then fitted in its own kind, which a modal model
allows with more remainders, ``s^2 R / (s - p) = R p^2 / (s - p) + R (s + p)``, and counts by its noise, which
the coherence tells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.described_modes import described_modes, no_resonance
from flexarm_bringup.identify.heard_outputs import band_of, deaf_outputs, sizes_of
from flexarm_bringup.identify.measurement import Responses
from flexarm_bringup.identify.mirrored import Mirrored, Sampled, mirrored_modes, without_mirrored
from flexarm_bringup.identify.simpler_methods import by_one_input, half_power_beside
from flexarm_bringup.identify.sources import Source
from flexarm_model.identification.automatic import Identified, identify_modes
from flexarm_model.identification.bootstrap import Scatter, bootstrap
from flexarm_model.identification.held_modes import Unsure, all_together, held_modes
from flexarm_model.identification.shadows import shadow_of
from flexarm_model.modal.fit import FitOptions, PoleFit
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.half_power import HalfPower
from flexarm_model.modal.partial_fractions import REMAINDERS
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

Array = NDArray[np.float64]
DRAWS, FEWEST_DRAWS = 20, 8  # of the bootstrap
EVERY_DRAW = 60_000  # lines of all responses that all draws together may fit
SEED = 0  # of the bootstrap
MOST_INPUTS = 6  # on the smaller side of the matrix; each more multiplies the poles
NEEDED_LINES = 1.0  # per bandwidth, for a damping that the data hold
WINDOWED_LINES = 6.0  # the same where a window has widened the resonance: below, it reads too high
POSITION = ".position"  # how outputs of encoders end
MIXED = (*REMAINDERS, 1, 2)  # remainders where the kinds differ


@dataclass(frozen=True)
class Request:
    """What was asked.

    Attributes:
        band_hz: Band of the modes [Hz]; None takes the band that was excited, or all lines but 0 Hz.
        coherence: Lines below it do not count [1].
        manipulator: Name or file of a manipulator to compare with; empty for none.
        preset: Its preset.
        motors_locked: The motors stood still in the test, instead of driving it.
        ignore: Outputs to leave out.
        pose: Actuated axes at the measurement [rad or m]; empty for home.
    """

    band_hz: tuple[float, float] | None
    coherence: float
    manipulator: str = ""
    preset: str = ""
    motors_locked: bool = False
    ignore: tuple[str, ...] = ()
    pose: tuple[float, ...] = ()


@dataclass(frozen=True)
class Result:
    """Everything that the page shows.

    Attributes:
        source: What was measured.
        responses: The part of it that was fitted.
        frf: Its matrix in the band, outputs by inputs, every output in its own kind.
        is_reciprocal: The fit took outputs for inputs, since there are fewer of them.
        weight: 1 for lines that count, of every output, (k, n_out); of all alike where outputs are inputs.
        found: The modes.
        scatter: By bootstrap over blocks; None without records.
        methods: Over methods; None without modes.
        half_power: Per mode by half-power on the largest response; words where it fails.
        single_hz: Frequencies that one input alone gives through the chart, without refinement [Hz].
        model_hz: Frequencies of the manipulator as described [Hz]; empty without one.
        deaf: Outputs left out, since they are incoherent on most lines, with the share of those [1].
        band_hz: The band [Hz].
        least_coherence: Lines below it did not count [1].
        unsure: Modes left out, since their frequency is not known to their bandwidth.
        mirrored: Per mode the described one above half the rate that it perhaps is; None where it is none.
        in_vain: Why nothing that is described can be found in the band; empty where something can.
    """

    source: Source
    responses: Responses
    frf: Frf
    is_reciprocal: bool
    weight: Array
    found: Identified
    scatter: Scatter | None
    methods: Scatter | None
    half_power: tuple[HalfPower | str, ...]
    single_hz: tuple[float, ...]
    model_hz: tuple[float, ...]
    deaf: dict[str, float]
    band_hz: tuple[float, float]
    least_coherence: float = 0.0
    unsure: tuple[Unsure, ...] = ()
    mirrored: tuple[Mirrored | None, ...] = ()
    in_vain: str = ""

    @property
    def own_fit(self) -> PoleFit | None:
        """The modes less those that perhaps are faster ones or none, with all that makes them unsure.

        A damping ratio that cannot be identified has an infinite sigma. None where there are no modes.
        """
        fit = self.found.fit
        if fit is None:
            return None
        sigma = all_together(fit, self.scatter, self.methods)
        known = fit.lines_per_bandwidth >= self.needed_lines
        zeta_std = np.where(known, sigma.zeta_std, np.inf)
        others = [faster or beside for faster, beside in zip(self.mirrored, self.shadows, strict=True)]
        return without_mirrored(replace(fit, f_std_hz=sigma.f_std_hz, zeta_std=zeta_std), others)

    @property
    def shadows(self) -> tuple[float | None, ...]:
        """Per pole that no linear arm has the frequency of the mode beside it [Hz]; None for the modes."""
        fit = self.found.fit
        if fit is None:
            return ()
        axes = [i for i, name in enumerate(self.responses.outputs) if name.endswith(POSITION)]
        beside = shadow_of(fit.model, () if self.is_reciprocal else axes)
        return tuple(float(fit.model.f_hz[j]) if j >= 0 else None for j in beside)

    @property
    def needed_lines(self) -> float:
        """Lines per bandwidth from which a damping can be identified."""
        return WINDOWED_LINES if self.is_windowed else NEEDED_LINES

    @property
    def is_windowed(self) -> bool:
        """Whether the responses come from records behind a window."""
        return self.source.lobe_lines > 0.0


@dataclass(frozen=True)
class _Recipe:
    """How responses become what is fitted; the same for every draw of the bootstrap."""

    outputs_left_out: tuple[str, ...]
    band_hz: tuple[float, float]
    size: Array  # of every output, (n_out,)

    def frf(self, responses: Responses) -> Frf:
        """Return the matrix in the band, its smaller side the inputs, outputs in units of their size."""
        matrix = responses.without(self.outputs_left_out).matrix().band(*self.band_hz)
        scaled = Frf(matrix.f_hz, matrix.H / self.size[:, None], matrix.kind)
        return scaled.transposed() if matrix.H.shape[1] < matrix.H.shape[2] else scaled


def identify(source: Source, request: Request, say: Callable[[str], None] = lambda text: None) -> Result:
    """Return the modes of a source.

    Args:
        source: What was measured.
        request: What was asked.
        say: Is told what is being done.

    Raises:
        ValueError: Responses are missing, the band holds too few lines, or there is no such arm or pose.
    """
    described = described_modes(request.manipulator, request.preset, request.pose, request.motors_locked)
    heard = source.responses.without(request.ignore)
    deaf = deaf_outputs(heard, request.band_hz, request.coherence)
    responses = heard.without(tuple(deaf))
    low, high = band_of(responses, request.band_hz)
    frf = responses.matrix().band(low, high)
    inside = (responses.f_hz >= low) & (responses.f_hz <= high)
    weight = responses.weight(request.coherence)[inside]
    is_reciprocal = frf.H.shape[1] < frf.H.shape[2]
    if is_reciprocal:
        weight = np.repeat(weight.min(axis=1)[:, None], frf.H.shape[2], axis=1)
    recipe = _Recipe((*request.ignore, *deaf), (low, high), sizes_of(responses, frf, inside))
    fitted = recipe.frf(source.responses)
    if fitted.H.shape[2] > MOST_INPUTS:
        raise ValueError(f"{fitted.H.shape[2]} references; at most {MOST_INPUTS} can be fitted at once")
    options = FitOptions(weight=weight, remainders=MIXED if responses.kinds else REMAINDERS)
    found = identify_modes(fitted, weight, options.remainders, source.lobe_lines, say)
    say("scatter: the fit by other methods, and over blocks drawn again")
    held = held_modes(fitted, found, options, source.lobe_lines, _drawing(source, recipe, fitted, options))
    fit = held.found.fit
    frequencies = tuple(map(float, fit.model.f_hz)) if fit else ()
    return Result(
        source, responses, frf, is_reciprocal, weight, _in_units(held.found, recipe.size, is_reciprocal),
        held.scatter, held.methods,
        tuple(half_power_beside(responses, frf, f_hz) for f_hz in frequencies),
        by_one_input(fitted, weight), tuple(map(float, described[0])), deaf, (low, high), request.coherence,
        held.unsure,
        _mirrored(fit, source.rate_hz, request, () if is_reciprocal else responses.outputs),
        no_resonance(*described, (low, high), request.motors_locked) if request.manipulator else "",
    )  # fmt: skip


def _drawing(
    source: Source, recipe: _Recipe, fitted: Frf, options: FitOptions
) -> Callable[[PoleFit], Scatter | None]:
    """Return what tells the scatter of a fit over blocks drawn again."""

    def drawn_again(fit: PoleFit) -> Scatter | None:
        """Return the scatter; None where there are no blocks."""
        draw = source.draw
        if draw is None:
            return None
        rng = np.random.default_rng(SEED)
        return bootstrap(lambda rng: recipe.frf(draw(rng)), fit, options, rng, draws_for(fitted))

    return drawn_again


def draws_for(frf: Frf) -> int:
    """Return the number of draws of the bootstrap: fewer where every one takes long."""
    return int(np.clip(EVERY_DRAW // frf.H.size, FEWEST_DRAWS, DRAWS))


def _in_units(found: Identified, size: Array, is_reciprocal: bool) -> Identified:
    """Return the modes with residues in the outputs' own units."""
    if found.fit is None:
        return found
    model = found.fit.model
    factor = size[None, :] if is_reciprocal else size[:, None]
    scaled = replace(model, residues=model.residues * factor, remainders=model.remainders * factor)
    return replace(found, fit=replace(found.fit, model=scaled))


def _mirrored(
    fit: PoleFit | None, rate_hz: float, request: Request, outputs: tuple[str, ...]
) -> tuple[Mirrored | None, ...]:
    """Return per mode what it perhaps is instead, as far as arm and rate are known."""
    if fit is None or not request.manipulator or not rate_hz:
        return (None,) * (fit.model.poles.size if fit else 0)
    config = load_config(find_manipulator(request.manipulator), request.preset)
    pose = np.array(request.pose) if request.pose else None
    return mirrored_modes(fit, Sampled(config, pose, request.motors_locked, rate_hz, outputs))
