"""Seed 003: the paper's three deviations beside those from synthetic robots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_data import POSES, published
from flexarm_bringup.reproduce.seed_003_robots import (
    DRAWN,
    FITTED_AT,
    MORE_SEEDS,
    SEEDS,
    Comparison,
    compare,
)

NOTED_AT_MID, NOTED_AWAY = (1.6, 3.5), (2.8, 7.3)  # dB, of the fitted lumped model
MODELS = {  # key -> what it is, values of the notes [dB]
    "rigid": ("rigid links, gear springs (null)", "7.4–12.0"),
    "lumped": ("lumped, datasheet stiffness", "5.7–7.4"),
    "first": ("lumped, one fit from the datasheet", None),
    "fitted": (
        "lumped, best of the fits at mid",
        "{:g}–{:g} at mid, {:g}–{:g} elsewhere".format(*NOTED_AT_MID, *NOTED_AWAY),
    ),
    "flex": ("S-node flex, nominal data", "2.5–3.0"),
}
PRINTED = {"rigid": "rigid", "fitted": "lumped", "flex": "flex"}  # the paper's models
UNKNOWN_FIT = (
    "the notes do not say how they fitted the lumped model; theirs is 1.6 dB or more off at its pose, the "
    "best fit here less, and what is true of a poor fit is not established of a good one"
)
NOT_COMPARABLE = "not comparable in value"


def paper_table() -> tuple[Table, list[Check]]:
    """Return the paper's three numbers beside ours, which are those of another robot."""
    values = published()
    rows: list[Cells] = []
    for key, name in PRINTED.items():
        ours = [compare(seed).deviations[key][FITTED_AT] for seed in SEEDS]
        rows.append([MODELS[key][0], values[f"frf_mean_abs_deviation_{name}_model"], *ours, NOT_COMPARABLE])
    columns = [Column("model"), Column("paper [dB]\nits robot", ".1f")]
    columns += [Column(f"ours [dB]\nseed {seed}", ".1f") for seed in SEEDS]
    notes = [
        "The paper compares with its measured robot, one unnamed pose; ours are synthetic robots at mid.",
        "Means of 36 curves, 4–100 Hz. The lumped model alone is fitted to what it is judged by.",
    ]
    return Table("Deviation of three models from a robot", [*columns, Column("remark")], rows, notes), []


def robot_table() -> tuple[Table, list[Check]]:
    """Return all models against all synthetic robots at all poses, and the ranking that is asked for."""
    results = [compare(seed) for seed in SEEDS]
    rows: list[Cells] = []
    for key, (what, notes) in MODELS.items():
        values = [result.deviations[key][pose] for result in results for pose in POSES]
        rows.append([what, notes, *values])
    columns = [Column("model"), Column("notes [dB]")]
    for seed in SEEDS:
        columns += [Column(f"seed {seed}\n{POSES[0]}" if p == POSES[0] else f"\n{p}", ".1f") for p in POSES]
    title = "Models against synthetic robots, 4–100 Hz [dB]"
    return Table(title, columns, rows, _notes(results)), _ranking_checks(results)


def _notes(results: list[Comparison]) -> list[str]:
    """Return what the fits found, and what the ranking away from their pose hangs on."""
    factors = [value for result in results for value in result.factors.values()]
    worse = [result.costs[0] / min(result.costs) for result in results]
    nearer = {key: nearer_away(results, key) for key in ("first", "fitted")}
    cases = len(results) * len(POSES)
    noted = {key: sum(is_as_noted(r.deviations[key], p) for r in results for p in POSES) for key in nearer}
    more = [compare(seed) for seed in MORE_SEEDS]
    away = [str(result.seed) for result in more if nearer_away([result], "fitted")[0]]
    return [
        f"Fitted over datasheet stiffness: {min(factors):.2f} to {max(factors):.1f} (notes 0.14–4.5), "
        f"where the robots' own springs have {DRAWN[0]:g} to {DRAWN[1]:g}.",
        "The fit has many minima. The best one is nearer to the robot than the flexible model in {} of {} "
        "cases away from its pose;".format(*nearer["fitted"]),
        f"of {len(more)} robots {len(away)} have such a case (seeds {', '.join(away) or 'none'}).",
        f"One fit from the datasheet leaves {min(worse):.1f} to {max(worse):.1f} times the squares of the "
        "best and is nearer in {} of {}.".format(*nearer["first"]),
        f"In the ranges of the notes are {noted['first']} of its {cases} deviations and {noted['fitted']} of "
        "the best fit's: how the notes fitted is not known.",
        "Seeds 0 to 2 and the prior of the fit were settled on after the outcome of others had been seen.",
    ]


def _ranking_checks(results: list[Comparison]) -> list[Check]:
    """Return the bounds of section 7, item 5; that on the fitted model is of a fit that is not described."""
    ranked = [is_ranked(result, pose) for result in results for pose in POSES]
    away, cases = nearer_away(results, "fitted")
    return [
        Check(
            "rigid > lumped unfitted > flex, three robots at three poses",
            f"{len(ranked)} of {len(ranked)}",
            f"{sum(ranked)} of {len(ranked)}",
            all(ranked),
        ),
        Check(
            "lumped, best fit, beats flex only at its own pose",
            f"0 of {cases} elsewhere",
            f"{away} of {cases} elsewhere",
            away == 0,
            excuse=UNKNOWN_FIT,
        ),
    ]


def nearer_away(results: Sequence[Comparison], key: str) -> tuple[int, int]:
    """Return in how many cases away from the fitted pose a model beats the flexible one, and of how many."""
    cases = [(result, pose) for result in results for pose in POSES if pose != FITTED_AT]
    return sum(beats(result, key, pose) for result, pose in cases), len(cases)


def is_ranked(result: Comparison, pose: str) -> bool:
    """Return whether rigid is farther off than lumped with datasheet springs, and that farther than flex."""
    rigid, lumped, flex = (result.deviations[key][pose] for key in ("rigid", "lumped", "flex"))
    return rigid > lumped > flex


def is_as_noted(fitted: Mapping[str, float], pose: str) -> bool:
    """Return whether a fitted model deviates as much as in the notes, to their digits [dB, by pose]."""
    low, high = NOTED_AT_MID if pose == FITTED_AT else NOTED_AWAY
    return low <= round(fitted[pose], 1) <= high


def beats(result: Comparison, key: str, pose: str) -> bool:
    """Return whether a model lies nearer to the robot than the flexible one at a pose."""
    return result.deviations[key][pose] < result.deviations["flex"][pose]
