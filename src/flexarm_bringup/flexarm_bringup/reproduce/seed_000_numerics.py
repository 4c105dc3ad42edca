"""Seed 000, sections 3 and 4: golden frequencies, and how fine a model must be."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_000_data import GROUPS, MODES, Array, Served, frame_hz, load, off_percent
from flexarm_bringup.reproduce.seed_000_frame import build_frame
from flexarm_bringup.reproduce.seed_000_rig import POSES, RIG
from flexarm_model.segments.segment_tree import SegmentTree

GOLDEN_HZ = {  # plane frame, 8 elements per link
    "A": (1.4041, 1.6819, 1.9102, 13.6052, 13.8773, 14.5651, 20.2382, 20.4087, 20.7244),
    "B": (1.3934, 1.7404, 1.8612, 13.5930, 13.9307, 14.5020, 20.2266, 20.5324, 20.5848),
    "centre": (1.6037, 1.6037, 1.8580, 13.6248, 14.1310, 14.1310, 20.4084, 20.4084, 20.5392),
}
GOLDEN_BOUND = 0.01  # %
SERVED_BOUND = 0.1  # %
FRF_BOUND = 0.05  # %, of all modes to 250 Hz
SEGMENT_BOUND = 0.25  # %
DOUBLET = 1e-6  # relative distance of the double modes at the centre
REFERENCE = 40  # elements per link of the reference
FRF_MODES = 27  # to 250 Hz
SEGMENTS = (4, 8, 16, 32)
GOLDEN_COLUMNS = (
    Column("mode", "d"),
    *(
        column
        for pose in ("A", "B", "centre")
        for column in (
            Column(f"{pose}\ngolden [Hz]", ".4f"),
            Column("\nbeam FE, n = 8", ".4f"),
            Column("\nserved to it [%]", "+.3f"),
        )
    ),
)
SIZE_COLUMNS = (
    Column("model, largest error [%] of"),
    Column("coordinates", "d"),
    Column("modes\n1–3", ".4f"),
    Column("modes\n4–6", ".4f"),
    Column("modes\n7–9", ".4f"),
    Column("all 27 to\n250 Hz", ".4f"),
)


def golden_table(served: Served) -> tuple[Table, list[Check]]:
    """Return golden frequencies, the frame's, and how near the served model comes."""
    frames = {pose: np.array(frame_hz(pose)) for pose in POSES}
    columns: list[Array] = []
    for pose, frame in frames.items():
        columns += [np.array(GOLDEN_HZ[pose]), frame, off_percent(served.f_hz(pose), frame)]
    rows: list[Cells] = [[i + 1, *values] for i, values in enumerate(np.column_stack(columns).tolist())]
    worst = _largest(off_percent(frames[pose], np.array(GOLDEN_HZ[pose])) for pose in POSES)
    far = _largest(off_percent(served.f_hz(pose), frames[pose]) for pose in POSES)
    apart = max(_apart(frames["centre"]), _apart(served.f_hz("centre")))
    checks = [
        _bound("golden frequencies, beam FE with 8 elements per link", worst, GOLDEN_BOUND, ".4f"),
        _bound("served model of 9 modes against them", far, SERVED_BOUND),
        Check(
            "double modes at the centre, beam FE and served",
            f"within {DOUBLET:g}",
            f"{apart:.1e}",
            apart <= DOUBLET,
        ),
    ]
    return Table("Golden frequencies at three poses, motors locked", GOLDEN_COLUMNS, rows), checks


def size_table(served: Served, fine: Served) -> tuple[Table, list[Check]]:
    """Return the largest errors of models of different size at pose A against 40 elements per link.

    Args:
        served: With one mode per strip.
        fine: With four modes per strip (preset "frf").
    """
    reference = np.array(frame_hz("A", REFERENCE, FRF_MODES))
    rows: list[Cells] = []
    errors: dict[str, Array] = {}
    for name, size, found in _models(served, fine):
        errors[name] = off_percent(found, reference[: found.size])
        parts = [_largest([errors[name][part]]) for part in list(GROUPS.values())[:3]]
        rows.append([name, size, *parts, _largest([errors[name]]) if found.size == FRF_MODES else None])
    notes = [
        "Reduced models: strips inextensible, hinges keep their position and leave their slope to the modes.",
        "Springs of segments stand at their centres; fewer than 16 per strip eat the tolerance of modes 7–9.",
    ]
    title = f"Pose A: how fine a model must be (reference: beam FE, {REFERENCE} elements per link)"
    return Table(title, SIZE_COLUMNS, rows, notes), _size_checks(errors, fine)


def _size_checks(errors: dict[str, Array], fine: Served) -> list[Check]:
    to_250 = _largest([off_percent(fine.f_hz("A"), np.array(frame_hz("A", 16, FRF_MODES)))])
    steps = np.diff(
        [errors[_segments(n)] for n in (8, 16, 32)], axis=0
    )  # free of what the reference has more
    order = np.log2(steps[0] / steps[1])
    return [
        _bound(f"{_SERVED}, against the reference, modes 1–9", _largest([errors[_SERVED]]), SERVED_BOUND),
        _bound(f"{_FINE}, against 16 elements, to 250 Hz", to_250, FRF_BOUND, ".4f"),
        _bound(f"{_segments(16)}, modes 1–9", _largest([errors[_segments(16)]]), SEGMENT_BOUND),
        Check(
            "order of convergence of the segments, 8 to 32",
            "2 ± 0.05",
            f"{order.min():.3f} to {order.max():.3f}",
            bool(abs(order - 2).max() <= 0.05),
        ),
    ]


_SERVED, _FINE = "served, 1 mode per strip", "served for FRFs, 4 modes per strip"


def _segments(n: int) -> str:
    return f"segment tree, {n} springs per strip"


def _models(served: Served, fine: Served) -> Iterator[tuple[str, int, Array]]:
    """Yield name, number of coordinates with motors locked, and frequencies [Hz]."""
    yield _SERVED, served.models["A"].n_eta, served.f_hz("A")
    yield _FINE, fine.models["A"].n_eta, fine.f_hz("A")
    for elements in (4, 8, 16):
        frame = build_frame(RIG, POSES["A"], elements)
        yield f"beam FE, {elements} elements per link", frame.M.shape[0], frame.frequencies(FRF_MODES)
    config = load()
    for n in SEGMENTS:
        tree = SegmentTree(config, n)
        found = tree.locked_frequencies(tree.close(config.poses["A"]), MODES)
        yield _segments(n), 6 * n, found / (2 * np.pi)


def _apart(f_hz: Array) -> float:
    """Return the largest relative distance of the three double modes of the symmetric pose."""
    return float(max(abs(f_hz[j] / f_hz[i] - 1) for i, j in ((0, 1), (4, 5), (6, 7))))


def _largest(percent: Iterable[Array]) -> float:
    return max(float(abs(values).max()) for values in percent)


def _bound(name: str, found: float, bound: float, digits: str = ".3f") -> Check:
    return Check(name, f"≤ {bound:g} %", f"{found:{digits}} %", found <= bound)
