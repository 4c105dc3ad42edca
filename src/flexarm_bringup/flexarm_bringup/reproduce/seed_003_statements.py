"""Seed 003, section 5: what the paper states and what the assumed robot says to it, with its numbers."""

from __future__ import annotations

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_comparison import is_ranked, nearer_away
from flexarm_bringup.reproduce.seed_003_data import POSES, model_at
from flexarm_bringup.reproduce.seed_003_orders import CB_BOUNDS, GUYAN_BOUNDS, partings
from flexarm_bringup.reproduce.seed_003_path import overshoots
from flexarm_bringup.reproduce.seed_003_robots import DRAWN, FITTED_AT, SEEDS, compare

CHECKED, OPEN, DIRECTION = "checked", "not checkable", "direction only"


def statement_table() -> tuple[Table, list[Check]]:
    """Return what the paper states and whether anything here can say so."""
    rows: list[Cells] = [
        *_on_reductions(),
        *_on_models(),
        ["9.8 / 5.5 / 4.5 dB", OPEN, "needs the measured robot"],
        ["path deviation +52 / +53 %", OPEN, "needs the measured robot and its path"],
        ["flex overshoots more in corners (no friction)", DIRECTION, overshoot_outcome(overshoots())],
        ["wrist coupling changes the responses slightly", "not established", "ratios are not printed"],
    ]
    columns = (Column("the paper says"), Column("here"), Column("outcome"))
    notes = [
        "By construction: bracket and tail of the assumed robot are there to make the reductions part.",
        "No measurement exists above 100 Hz: the paper cannot rank reductions where they differ.",
    ]
    return Table("Which statements can be checked", columns, rows, notes), []


def _on_reductions() -> list[Cells]:
    """Return the statements on Guyan and Craig-Bampton."""
    found = partings()
    small, *others = (model_at(name, FITTED_AT).n for name in ("guyan", "cb_500", "cb_1000"))
    together, apart = GUYAN_BOUNDS
    same, differ = CB_BOUNDS
    outcomes = {
        "Guyan and Craig-Bampton coincide below 100 Hz": (
            found.below <= together,
            f"{found.below:.3f} dB (≤ {together})",
        ),
        "Guyan departs just above 100 Hz": (
            found.above >= apart,
            f"{found.above:.3f} dB in 100–150 Hz (≥ {apart}), by construction",
        ),
        "CB-500 and CB-1000 differ only above 300 Hz": (
            found.same <= same and found.differ >= differ,
            f"{found.same:.3f} dB below (≤ {same}), {found.differ:.3f} above (≥ {differ}), by construction",
        ),
        "off-diagonal elements are affected most": (
            found.other > found.diagonal,
            f"diagonal {found.diagonal:.3f}, others {found.other:.2f} dB in 100–300 Hz",
        ),
        "Guyan is the smaller model": (
            small < min(others),
            f"{small} against {' and '.join(map(str, others))}",
        ),
    }
    return [[says, CHECKED, outcome(*found)] for says, found in outcomes.items()]


def _on_models() -> list[Cells]:
    """Return the statements on rigid, lumped and flexible model."""
    results = [compare(seed) for seed in SEEDS]
    cases = [(result, pose) for result in results for pose in POSES]
    ranked = [is_ranked(*case) for case in cases]
    factors = [value for result in results for value in result.factors.values()]
    low, high = min(factors), max(factors)
    return [
        [
            "rigid far off, lumped above flex",
            CHECKED,
            ranking_outcome(ranked, nearer_away(results, "fitted")),
        ],
        [
            "lumped stiffnesses are no physical components",
            CHECKED,
            outcome(
                low < DRAWN[0] or high > DRAWN[1],
                f"factors {low:.2f} to {high:.1f}, those of the robot's springs {DRAWN[0]:g} to {DRAWN[1]:g}",
            ),
        ],
    ]


def outcome(holds: bool, numbers: str) -> str:
    """Return a verdict with the numbers that it was made from."""
    return f"{'holds' if holds else 'does not hold'}: {numbers}"


def ranking_outcome(ranked: list[bool], nearer: tuple[int, int]) -> str:
    """Return whether lumped is above flex, unfitted and, as the paper has it, fitted.

    Args:
        ranked: Whether rigid > lumped unfitted > flex, by robot and pose.
        nearer: In how many cases away from its pose the best fit is below flex, and of how many.
    """
    away, cases = nearer
    numbers = (
        f"unfitted in {sum(ranked)} of {len(ranked)} cases; fitted, as the paper has it, it is below flex in "
        f"{away} of {cases} away from its pose"
    )
    if all(ranked) and away:
        return f"mixed: {numbers}"
    return outcome(all(ranked), numbers)


def overshoot_outcome(found: dict[str, list[tuple[float, float]]]) -> str:
    """Return how often the flexible robot overshoots more without friction than with it.

    Args:
        found: By reading of "with friction", pairs without and with it [mm].
    """
    more = [bare > rubbed for pairs in found.values() for bare, rubbed in pairs]
    if all(more) or not any(more):
        return outcome(all(more), f"{sum(more)} of {len(more)} cases of the path test")
    return f"mixed: {sum(more)} of {len(more)} cases of the path test"
