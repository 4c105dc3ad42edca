"""The tables and the acceptance bounds of ``flexarm sim``."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cell, Column, Page, Table
from flexarm_bringup.processes.machine_speed import in_words
from flexarm_bringup.residual import decibels
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.study import SimResult
from flexarm_bringup.tasks.task import Task, other_law
from flexarm_model.manipulator.description import ManipulatorConfig

FASTEST_DDS = 250.0  # Hz; 200 Hz is kept over DDS in real time on two shared cores, 500 Hz is not
GROWS = 1.2  # residual of the second half of the window over the first: more is no decay
BASELINE, LAW = "pd", "mpc"

COLUMNS = (
    Column("the arm"),
    Column("move"),
    Column("law"),
    Column("residual\n[m/s²]", ".4f"),
    Column("against\nPD [dB]", "+.1f"),
    Column("off rest\n[mm RMS]", ".3f"),
    Column("settles\n[s]", ".3f"),
    Column("off path\n[mm]", ".2f"),
    Column("torque\n[% of limit]", ".0f"),
    Column("stable"),
    Column("simulated\ns per CPU s", ".1f"),
)


def build_page(
    task: Task,
    configs: dict[str, ManipulatorConfig],
    results: Sequence[SimResult],
    figures: Sequence[Figure],
    seed: int,
    slow: float = 1.0,
) -> Page:
    """Return everything a simulation has to say.

    Args:
        task: What was done.
        configs: Description of every preset.
        results: Every law under every condition.
        figures: What the tip did.
        seed: Of the rig's noise.
        slow: How many times as long this machine takes as the class that the bound on speed means [1].
    """
    config = next(iter(configs.values()))
    tables = [_table(task, configs[preset], preset, results) for preset in configs]
    return Page(
        title=f"flexarm sim {config.name}: MPC against joint PD on the same reference",
        lead="Rig, estimator and controller in lockstep in one process; both laws have the same model, "
        f"reference and torque limits. Noise of the rig: seed {seed}.",
        items=[*tables, *figures],
        checks=[*worth_checks(task, results), _speed_check(task, results, slow)],
        remarks={
            "read it so": [real_time_note(config), *_CAVEATS, *other_law(task, configs), *machine_note(slow)]
        },
        data={"seed": seed, "rate_hz": config.rate_hz, "real_time_over_dds": config.rate_hz <= FASTEST_DDS},
    )


_CAVEATS = (
    "residual: RMS of the tip's true acceleration in the window after a move; off rest: from its end",
    "off path: largest distance of the tip from where the described arm would have it if it moved slowly",
    "settles 'never': not within the window that was watched; below 0: before the end of the move, at "
    "minus its duration where the move is smaller than the tolerance",
    "the arm is simulated, with more modes than the controller knows, noise and delay; dB are of that rig",
)


def gain_db(pair: dict[str, SimResult]) -> float:
    """Return by how much MPC leaves less than joint PD, all moves together [dB]."""
    return decibels(pair[BASELINE].acceleration, pair[LAW].acceleration)


def is_stable(result: SimResult, baseline: SimResult) -> bool:
    """Tell whether a run ends well: no stop, a state, no vibration that is above the baseline's and grows."""
    feeds = any(
        leg.residual.growth > GROWS and leg.residual.acceleration > other.residual.acceleration
        for leg, other in zip(result.legs, baseline.legs, strict=True)
    )
    return not result.failure and not feeds


def by_condition(results: Sequence[SimResult]) -> dict[tuple[str, str], dict[str, SimResult]]:
    """Return the results by (preset, condition) and law, in order."""
    pairs: dict[tuple[str, str], dict[str, SimResult]] = {}
    for result in results:
        pairs.setdefault((result.preset, result.condition), {})[result.law] = result
    return pairs


def _table(task: Task, config: ManipulatorConfig, preset: str, results: Sequence[SimResult]) -> Table:
    pairs = by_condition(results)
    nominal = pairs[preset, NOMINAL][BASELINE]
    rows: list[list[Cell]] = []
    own = {condition: pair for (of, condition), pair in pairs.items() if of == preset}
    for condition, pair in own.items():
        for i in range(len(pair[BASELINE].legs)):
            for law, result in pair.items():
                end: list[Cell] = [is_stable(result, nominal), result.effort.speed]
                leg = result.legs[i]
                rows.append([condition, leg.leg.name, law.upper(), *_cells(result, i, pair[BASELINE]), *end])
    described = pairs[preset, NOMINAL][LAW]
    adopted = described.effort
    notes = [
        f"control rate {config.rate_hz:g} Hz, {config.modes} modes; window "
        f"{task.watch.begin:g} to {task.watch.end:g} s after a move, up to {task.watch.cutoff_hz:g} Hz; "
        f"settled within {1e3 * task.watch.tolerance:g} mm",
        f"{adopted.served} models adopted on the way, {_each_ms(adopted.adopt_time, adopted.served)}",
        *described.told,
        *_refused(task, preset, config.modes, pairs[preset, NOMINAL]),
        *(f"{r.condition}, {r.law.upper()}: {r.failure}" for pair in own.values() for r in _failed(pair)),
    ]
    return Table(f"Preset {preset or 'as in the file'}", COLUMNS, rows, notes)


def _refused(task: Task, preset: str, modes: int, pair: dict[str, SimResult]) -> list[str]:
    """Return where over DDS a law would not be armed and why, and how to look closer."""
    told = [f"over DDS {law.upper()} may not move: {text}" for law, r in pair.items() for text in r.refusals]
    if not told:
        return []
    words = ["./flexarm", "margins", task.file or task.manipulator, *(["--preset", preset] if preset else [])]
    served = f"one above mode {modes} is not served: serve it, too (served.modes), or see docs/margins.md"
    return [*told, f"{shlex.join(words)} shows the margins of every mode; {served}"]


def _cells(result: SimResult, i: int, baseline: SimResult) -> list[Cell]:
    """Return the figures of a move; of a run that failed no gain and no settling, for it may have stood."""
    leg, other = result.legs[i], baseline.legs[i]
    left, failed = leg.residual, bool(result.failure)
    gain = None if failed or baseline.failure else decibels(left.acceleration, other.residual.acceleration)
    return [
        left.acceleration,
        gain,
        1e3 * left.distance,
        None if failed else left.settling,
        1e3 * leg.tracking,
        100 * leg.peak,
    ]


def _failed(pair: dict[str, SimResult]) -> list[SimResult]:
    return [result for result in pair.values() if result.failure]


def _each_ms(seconds: float, count: int) -> str:
    return f"{1e3 * seconds / count:.1f} ms each" if count else "one does for the whole way"


def worth_checks(task: Task, results: Sequence[SimResult]) -> list[Check]:
    """Return the bounds on what MPC gains under every condition, and that no run of it is unstable."""
    checks = []
    first = task.presets[0] if task.presets[0] in {r.preset for r in results} else results[0].preset
    for (preset, condition), pair in by_condition(results).items():
        if preset != first:
            continue
        name = f"{condition}: MPC below joint PD, all moves"
        wanted = f"at least {task.gain_db:g} dB"
        if failed := _failed(pair):
            text = ", ".join(result.law.upper() for result in failed)
            checks.append(Check(name, wanted, f"none: {text} did not lead the arm", False))
            continue
        gain = gain_db(pair)
        checks.append(Check(name, wanted, f"{gain:.1f} dB", gain >= task.gain_db))
    nominal = {p: pair[BASELINE] for (p, c), pair in by_condition(results).items() if c == NOMINAL}
    shaky = [r for r in results if r.law == LAW and not is_stable(r, nominal[r.preset])]
    return [*checks, Check("no MPC run is unstable", "none", f"{len(shaky)}", not shaky)]


def _speed_check(task: Task, results: Sequence[SimResult], slow: float) -> Check:
    slowest = min(result.effort.speed for result in results if result.law == LAW)
    wanted = f"at least {task.speed:g} times real time"
    found = f"{slowest:.1f} times" + (f"; by {slow:.2f}: {slowest * slow:.1f}" if slow > 1.0 else "")
    return Check("lockstep, slowest MPC run", wanted, found, slowest * slow >= task.speed)


def machine_note(slow: float) -> list[str]:
    """Return what is judged of the speed on a machine that is slower than the bound means."""
    return [] if slow == 1.0 else [f"{in_words(slow)}: the speed is judged times that"]


def real_time_note(config: ManipulatorConfig) -> str:
    """Return whether the machine's rate can be kept over DDS in real time."""
    if config.rate_hz > FASTEST_DDS:
        return (
            f"this machine needs {config.rate_hz:g} Hz: in lockstep only; over DDS in real time a computer "
            f"of this class keeps up to about {FASTEST_DDS:g} Hz"
        )
    return f"{config.rate_hz:g} Hz may also be kept over DDS in real time: flexarm demo measures it"
