"""Modal least squares with common poles: residues eliminated, poles refined (variable projection).

    min over (lambda, L)  |Y - Phi Phi^+ Y|^2        Phi(lambda, L) of ``partial_fractions``

What the linear unknowns can explain is projected out, so that Gauss-Newton works on two numbers per
mode (and the participations of further inputs) only [Golub1973], with Kaufman's Jacobian
``-(1 - Phi Phi^+) dPhi Phi^+ Y`` [Kaufman1975]. Its Gram matrix is the information on the poles
with everything else unknown, which gives their standard deviations for white noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf
from flexarm_model.modal.line_weights import repeated_weights, shared_weights
from flexarm_model.modal.partial_fractions import REMAINDERS, Basis
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.modal.residues import ModalFit, as_one_input, check_determined, fit_residues
from flexarm_model.modal.variable_projection import Compressed, JointProjection, Projection

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

TOLERANCE = 1e-10  # relative change of cost and of poles in bandwidths
MAX_EVALUATIONS = 200


@dataclass(frozen=True)
class FitOptions:
    """How to fit.

    Attributes:
        rank_one: Residues of a mode are ``psi L'``, which parts close and double modes when there are
            several inputs; false leaves every residue free.
        weight: Of every line, (k,), or of every line and output, (k, n_out); 0 masks, None weighs all alike.
        remainders: Powers of j w for the modes out of band.
    """

    rank_one: bool = True
    weight: Array | None = None
    remainders: tuple[int, ...] = REMAINDERS


@dataclass(frozen=True)
class PoleFit:
    """Refined poles with their uncertainty, slowest first.

    Attributes:
        model: The fitted modal model.
        f_std_hz: One sigma of the natural frequencies [Hz], (r,).
        zeta_std: One sigma of the damping ratios [1], (r,).
        lines_per_bandwidth: ``2 zeta f`` over the line spacing [1], (r,); damping read from fewer than
            one line rests on the model alone (leakage and frequency drift look the same).
        at_bound: The pole ran to the edge of the band or of the damping allowed, (r,).
        converged: The iteration settled.
        evaluations: Number of evaluations.
    """

    model: ModalFit
    f_std_hz: Array
    zeta_std: Array
    lines_per_bandwidth: Array
    at_bound: NDArray[np.bool_]
    converged: bool
    evaluations: int

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def fit_poles(
    frf: Frf, poles: Complex, participation: Complex | None = None, options: FitOptions | None = None
) -> PoleFit:
    """Return the modal model whose poles fit best, starting from given ones.

    The smaller side of the matrix should be the inputs (``frf.transposed()``).

    Args:
        frf: Measured responses in the band of the modes.
        poles: Start, within about a bandwidth [rad/s], (r,).
        participation: Start of L, (r, n_in), when residues are of rank one; None takes it from a
            fit of free residues, which needs poles that are apart.
        options: How to fit; None is the default.

    Raises:
        UnderdeterminedError: Fewer equations than unknowns, or starts that coincide.
        ValueError: A start lies outside the band.
    """
    options = options or FitOptions()
    poles = np.asarray(poles, dtype=complex)
    split = frf if options.rank_one else as_one_input(frf)
    copies = split.H.shape[1] // frf.H.shape[1]
    options = replace(options, weight=repeated_weights(options.weight, copies))
    L = _start_participation(split, poles, participation if options.rank_one else None, options)
    problem = _problem(split, poles, L, options)
    start, bounds = problem.pack(poles, L), problem.bounds()
    if ((start <= bounds[0]) | (start >= bounds[1])).any():
        raise ValueError(f"start poles {poles} lie outside the band {frf.f_hz[0]}..{frf.f_hz[-1]} Hz")
    compressed = Compressed(problem)
    found = scipy.optimize.least_squares(
        compressed.residual, start, compressed.jacobian, bounds, x_scale=problem.scale(poles), method="trf",
        xtol=TOLERANCE, ftol=TOLERANCE, gtol=TOLERANCE, max_nfev=MAX_EVALUATIONS,
    )  # fmt: skip
    refined, L = problem.unpack(found.x)
    model = fit_residues(split, refined, L, options.weight, options.remainders)
    model = replace(
        model,
        residues=model.residues.reshape(-1, *frf.H.shape[1:]),
        remainders=model.remainders.reshape(-1, *frf.H.shape[1:]),
    )
    return _result(problem, found, model)


def _problem(split: Frf, poles: Complex, L: Complex, options: FitOptions) -> JointProjection:
    """Return the problem, outputs that count on the same lines together."""
    parts = []
    for shared in shared_weights(options.weight, split.H.shape[1]):
        basis = Basis.of(split, shared.weight, options.remainders)
        part = Projection(basis, basis.data(split.H[:, shared.outputs]), L)
        check_determined(basis, poles.size, shared.outputs.size, part.n_parameters)
        parts.append(part)
    size = max(np.sqrt(sum(np.sum(part.Y**2) for part in parts)), np.finfo(float).tiny)
    return JointProjection([Projection(part.basis, part.Y / size, L) for part in parts])  # for the tolerances


def _start_participation(
    frf: Frf, poles: Complex, participation: Complex | None, options: FitOptions
) -> Complex:
    """Return L with its largest entry 1, (r, n_in)."""
    if participation is None:
        residues = fit_residues(frf, poles, None, options.weight, options.remainders).residues
        order = np.argsort(np.argsort(abs(poles), kind="stable"))
        participation = np.linalg.svd(residues[order])[2][:, 0, :]
    L = np.asarray(participation, dtype=complex)
    if L.shape != (poles.size, frf.H.shape[2]):
        raise ValueError(
            f"participation {L.shape} does not fit {poles.size} poles and {frf.H.shape[2]} inputs"
        )
    return np.asarray(L / np.take_along_axis(L, abs(L).argmax(axis=1)[:, None], axis=1))


def _result(problem: JointProjection, found: scipy.optimize.OptimizeResult, model: ModalFit) -> PoleFit:
    """Return the fit with uncertainty, modes in the order of the model."""
    r, basis = problem.n_modes, problem.parts[0].basis
    order = np.argsort(abs(problem.unpack(found.x)[0]), kind="stable")
    decay, omega = found.x[:r][order], found.x[r : 2 * r][order]
    covariance = _covariance(problem, found)
    var_decay, var_omega = (np.diag(covariance)[part][order] for part in (slice(0, r), slice(r, 2 * r)))
    cross = np.diag(covariance[:r, r : 2 * r])[order]
    size = abs(model.poles)
    var_size = (decay**2 * var_decay + omega**2 * var_omega + 2 * decay * omega * cross) / size**2
    var_zeta = (omega**2 * var_decay + decay**2 * var_omega - 2 * decay * omega * cross) * (
        omega / size**3
    ) ** 2
    bound = (found.active_mask[: 2 * r] != 0).reshape(2, r).any(axis=0)[order]
    spacing = np.median(np.diff(abs(basis.s)))
    return PoleFit(
        model,
        np.sqrt(np.maximum(var_size, 0.0)) / (2 * np.pi),
        np.sqrt(np.maximum(var_zeta, 0.0)),
        2 * decay / spacing,
        bound,
        bool(found.success),
        int(found.nfev),
    )


def _covariance(problem: JointProjection, found: scipy.optimize.OptimizeResult) -> Array:
    """Return the covariance of p for white noise of the size of what is left, (n_p, n_p); nan without any."""
    variance = 2 * found.cost / problem.n_spare if problem.n_spare else np.nan
    scale = problem.scale(problem.unpack(found.x)[0])
    triangle = np.linalg.qr(found.jac * scale, mode="r")
    inverse = np.linalg.pinv(triangle) * scale[:, None]
    return np.asarray(variance * inverse @ inverse.T)
