"""Seed 000, the modal test on the model: roving hammer, three accelerometers, CMIF, one frequency response.

Accelerometers across the platform ends of the second strips, as mounted; hammer across both ends and the
middle of every strip; lines as in the paper. Every mode is given the damping ratio of the strips, which all
modes of the description have at home.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.damping_check import damping_check
from flexarm_bringup.reproduce.seed_000_data import MODES, Published, Served, load, serve
from flexarm_bringup.reproduce.seed_000_frame import Frame, build_frame
from flexarm_bringup.reproduce.seed_000_rig import POSES, RIG
from flexarm_model.modal.cmif import Cmif, CmifPeak, cmif, pick_modes, track_curves
from flexarm_model.modal.frf import Frf, Ports, modal_frf
from flexarm_model.modal.model_frf import displacement_row
from flexarm_model.modal.modes import Modes, model_modes, normal_modes

Array = NDArray[np.float64]

LINE_HZ = 0.3125
LINES_HZ: Array = LINE_HZ * np.arange(1.0, 801.0)  # to 250 Hz, a record of 3.2 s
RATIO = 0.01  # of every mode in the notes; assumed
TIMES = (1, 2, 3)  # the described damping
LOWEST_HZ = 1.25  # peaks below are ignored
HIGHEST_HZ = 25.0  # beyond the ninth mode
PROMINENCE_DB = 1.0
HALF_DIGIT = 0.0051  # Hz: half of the last one printed, and 1.875 printed 1.87
LINES_OFF = (2, 2, 2, 1, 1, 1, 1, 1, 1)  # how far a peak may be from its mode [lines]
OUTPUTS = tuple(f"accelerometer_{leg}.y" for leg in (1, 2, 3))
POINTS = tuple(
    f"{strip}_{leg}.{at}"
    for leg in (1, 2, 3)
    for strip in ("first", "second")
    for at in ("root", "middle", "tip")
)
MIDDLES = tuple(f"first_{leg}.middle" for leg in (1, 2, 3))
GOLDEN_FRF = {1.25: 0.447, 1.5625: 4.18, 13.75: 1.38, 20.3125: 32.0, 50.0: 0.363, 100.0: 0.070, 200.0: 0.320}
FRF_BOUND = 1.0  # % of the golden values, three digits of which are printed
TRUNCATION = {
    MODES: ((0.325, 0.335), (53.5, 54.5)),
    27: ((0.0, 0.005), (0.55, 0.65)),
}  # % to 30 and to 250 Hz
PEAK_COLUMNS = (
    Column("mode"),
    *(
        column
        for pose in "AB"
        for column in (
            Column(f"pose {pose}\nmode [Hz]", ".4f"),
            Column("\npeak [Hz]", ".4f"),
            Column("\nlines off", "+.1f"),
            Column("\npaper EMA [Hz]", ".2f"),
        )
    ),
)
FRF_COLUMNS = (
    Column("line [Hz]", ".4f"),
    Column("golden\n[m/s²/N]", ".3g"),
    Column("beam FE\nn = 8", ".4f"),
    Column("served,\n27 modes", ".4f"),
    Column("served,\n9 modes", ".4f"),
)


@dataclass(frozen=True)
class ModalTest:
    """Responses of the served models and what is picked from them.

    Attributes:
        responses: By number of modes and pose, outputs to all hammer points, (k, 3, 18).
        peaks: By multiple of the damping and pose, of the 27-mode model, below 25 Hz.
        ratio: Damping ratio of every mode, as described [1].
    """

    responses: Mapping[tuple[int, str], Frf]
    peaks: Mapping[tuple[int, str], tuple[CmifPeak, ...]]
    ratio: float

    def response(self, modes: int, point: str, output: str) -> NDArray[np.complex128]:
        """Return one response at pose A [m/s^2/N], (k,)."""
        return np.asarray(self.responses[modes, "A"].H[:, OUTPUTS.index(output), POINTS.index(point)])


def run_modal_test() -> ModalTest:
    """Do the test on both served models at both poses."""
    responses, peaks = {}, {}
    machines = {preset: _with_hammer(preset) for preset in ("", "frf")}
    ratio = float(machines[""].home_zeta.mean())
    for preset, served in machines.items():
        for pose in "AB":
            for times in TIMES if preset else TIMES[:1]:
                found = hit(served, pose, times * ratio)
                if times == 1:
                    responses[served.models[pose].n_eta, pose] = found
                if preset:
                    peaks[times, pose] = pick(curves(found))
    return ModalTest(responses, peaks, ratio)


def hit(served: Served, pose: str, ratio: float) -> Frf:
    """Return accelerations per force with the motors locked [m/s^2/N], (k, 3, 18)."""
    model = served.models[pose]
    modes = replace(model_modes(model), damping=2 * ratio * model.omega)
    B = np.array([displacement_row(model, f"{_hammer(point)}.y") for point in POINTS]).T
    C = np.array([displacement_row(model, name) for name in OUTPUTS])
    return modal_frf(LINES_HZ, modes, Ports(B, C), "accelerance")


def curves(responses: Frf) -> Cmif:
    """Return the CMIF's curves, continued through their crossings."""
    return track_curves(cmif(responses))


def pick(found: Cmif) -> tuple[CmifPeak, ...]:
    """Return the peaks within the range of the nine modes."""
    peaks = pick_modes(found, PROMINENCE_DB, LOWEST_HZ)
    return tuple(sorted((p for p in peaks if p.peak.line_hz < HIGHEST_HZ), key=lambda p: p.peak.line_hz))


def peak_table(test: ModalTest, served: Served, published: Published) -> tuple[Table, list[Check]]:
    """Return the picked lines beside the modes that made them."""
    columns: list[Array] = []
    checks = [damping_check("all modes at home", served.home_zeta, RATIO)]
    for pose in "AB":
        f_hz, lines = served.f_hz(pose), _nine([p.peak.line_hz for p in test.peaks[1, pose]])
        off = (lines - f_hz) / LINE_HZ
        columns += [f_hz, lines, off, published.ema[pose]]
        first, rest = (float(abs(off[part]).max()) for part in (slice(0, 3), slice(3, 9)))
        name = f"CMIF peaks at pose {pose}, distance from modes 1–3 / 4–9"
        found = f"{first:.2f} / {rest:.2f} lines"
        checks.append(Check(name, "2 / 1 lines", found, bool((abs(off) <= LINES_OFF).all())))
    rows: list[Cells] = [[str(i + 1), *row] for i, row in enumerate(np.column_stack(columns).tolist())]
    counted = {times * test.ratio: [len(test.peaks[times, pose]) for pose in "AB"] for times in TIMES}
    notes = [
        f"3 accelerometers, 18 hammer points, ζ = {test.ratio:g} (assumed), no noise; "
        f"one line is {LINE_HZ} Hz.",
        first_lines(columns[1][:3], columns[3][:3]),
        "Peaks found at poses A and B: "
        + "; ".join(f"{found[0]} and {found[1]} with ζ = {ratio:g}" for ratio, found in counted.items())
        + ".",
    ]
    return Table("Modal test on the model: peaks of the CMIF", PEAK_COLUMNS, rows, notes), checks


def first_lines(found: Array, measured: Array) -> str:
    """Return on which lines modes 1 to 3 fall at pose A, and whether the paper's are these.

    Args:
        found: Our peaks [Hz], (3,).
        measured: The paper's, two digits printed [Hz], (3,).
    """
    if not np.isfinite(found).all():
        return "Not every mode has a peak of its own at pose A: nothing to compare with the paper's lines."
    same = bool((abs(found - measured) <= HALF_DIGIT).all())
    lines, printed = (
        ", ".join(f"{value:{form}}" for value in values)
        for values, form in ((found, ".4f"), (measured, ".2f"))
    )
    verdict = "is what this grid must give" if same else "is not what this grid gives"
    return f"Modes 1–3 fall on {lines} Hz at pose A: the paper's {printed} {verdict}."


def response_table(test: ModalTest) -> tuple[Table, list[Check]]:
    """Return one response, the middle of the first strip to the end of the second one of leg 1, pose A."""
    frame = build_frame(RIG, POSES["A"])
    at = [int(np.argmin(abs(LINES_HZ - line_hz))) for line_hz in GOLDEN_FRF]
    golden = np.array(list(GOLDEN_FRF.values()))
    found = abs(frame_response(frame, frame_modes(frame, test.ratio), LINES_HZ[at]))
    served = [abs(test.response(n, "first_1.middle", OUTPUTS[0]))[at] for n in (27, MODES)]
    rows: list[Cells] = np.column_stack([LINES_HZ[at], golden, found, *served]).tolist()
    worst = float(100 * abs(found / golden - 1).max())
    name = "one response of the beam FE at seven lines"
    checks = [Check(name, f"within {FRF_BOUND:g} %", f"{worst:.2f} %", worst <= FRF_BOUND)]
    notes = ["Regression only: the paper prints no values; leg and point are assumed."]
    title = f"|H| from the middle of first strip 1 to the end of second strip 1, pose A, ζ = {test.ratio:g}"
    return Table(title, FRF_COLUMNS, rows, notes), [*checks, *_truncation_checks(test.ratio)]


def _truncation_checks(ratio: float) -> list[Check]:
    """Return what the first modes alone miss of that response of a fine frame."""
    fine = build_frame(RIG, POSES["A"], 40)
    modes = frame_modes(fine, ratio)
    whole, checks = frame_response(fine, modes, LINES_HZ), []
    for count, ranges in TRUNCATION.items():
        cut = frame_response(fine, modes.first(count), LINES_HZ)
        errors = [_relative(cut, whole, highest) for highest in (30.0, 250.0)]
        wanted = " / ".join(f"{low:g} … {high:g}" for low, high in ranges)
        name = f"first {count} modes alone, error of that response to 30 / 250 Hz"
        met = all(low <= error <= high for error, (low, high) in zip(errors, ranges, strict=True))
        checks.append(Check(name, f"{wanted} %", f"{errors[0]:.3f} / {errors[1]:.2f} %", met))
    return checks


def frame_modes(frame: Frame, ratio: float) -> Modes:
    """Return the modes of the plane frame with a damping ratio [1], shapes (n, n)."""
    modes = normal_modes(frame.M, np.zeros_like(frame.M), frame.K)
    return Modes(modes.omega, 2 * ratio * modes.omega, modes.shapes)


def frame_response(frame: Frame, modes: Modes, f_hz: Array) -> NDArray[np.complex128]:
    """Return the same response of the plane frame from its modes, or the first of them [m/s^2/N], (k,)."""
    ports = Ports(frame.middle(0, 1)[:, None], frame.hinges[0][None])
    return np.asarray(modal_frf(f_hz, modes, ports, "accelerance").H[:, 0, 0])


def _with_hammer(preset: str) -> Served:
    """Return the served models with rows at every hammer point."""
    config = load(preset)
    mounted = next(sensor for sensor in config.sensors if f"{sensor.name}.y" == OUTPUTS[0])
    hammers = tuple(replace(mounted, name=_hammer(point), site=point) for point in POINTS)
    return serve(replace(config, sensors=(*config.sensors, *hammers)))


def _hammer(point: str) -> str:
    return "hammer_" + point.replace(".", "_")


def _nine(lines_hz: list[float]) -> Array:
    """Return the lines of nine peaks; what was not found is NaN, which no bound forgives."""
    found = np.full(MODES, np.nan)
    if len(lines_hz) == MODES:
        found[:] = lines_hz
    return found


def _relative(found: NDArray[np.complex128], reference: NDArray[np.complex128], highest_hz: float) -> float:
    """Return the root of squared errors over that of the response to ``highest_hz`` [%]."""
    inside = slice(int(np.searchsorted(LINES_HZ, highest_hz, side="right")))
    return float(100 * np.linalg.norm((found - reference)[inside]) / np.linalg.norm(reference[inside]))
