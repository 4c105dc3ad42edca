"""What retuning says: settings with their rules, before and after on the simulated rig, margins per path."""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_bringup.page.report import Cell, Cells, Column, Table
from flexarm_bringup.residual import decibels
from flexarm_bringup.retune.moves_text import write_number
from flexarm_bringup.retune.proposal import RULES, Proposal
from flexarm_bringup.retune.search import WORSE, Search
from flexarm_bringup.retune.trial import Trial

MM, MS, PERCENT = 1e3, 1e3, 100.0
LONGEST_TEXT = 44  # of a value in the table of settings [characters]


Pair = tuple[Trial, Trial]


def retune_tables(proposal: Proposal, trials: Pair, unlearned: Pair | None) -> list[Table]:
    """Return the tables of a proposal and of its trials.

    Args:
        proposal: What was proposed.
        trials: Before and after.
        unlearned: The same with a law that does not learn; None where it never does.
    """
    chosen = [_settings(proposal), _search(proposal.searched), _shaper(proposal)]
    return [*chosen, _worth(trials, unlearned), _margins(*trials)]


def _settings(proposal: Proposal) -> Table:
    heads = [Column("setting"), Column("before"), Column("after"), Column("rule")]
    rows: list[Cells] = []
    for (section, values), old in zip(proposal.changes.items(), proposal.old, strict=True):
        for name, value in values.items():
            text = _short(write_number(getattr(old, name)))
            rows.append([f"{section}.{name}", text, _short(write_number(value)), RULES[name]])
    kept = proposal.kept
    notes = [f"one sigma of the updated frequencies: {PERCENT * proposal.doubt:.2g} %"]
    notes.append(
        f"margins: {kept.trouble or 'kept'}" + (f", after {kept.tries} steps back" if kept.tries else "")
    )
    return Table("Settings retuned", heads, rows, notes)


def _search(search: Search) -> Table:
    heads = [
        Column("step"),
        Column("setting"),
        Column("times", ".3g"),
        Column("left on the twins\n[m/s^2]", ".4g"),
    ]
    rows: list[Cells] = [["rules", None, None, search.begin]]
    rows += [[i + 1, step.name, step.factor, step.residual] for i, step in enumerate(search.steps)]
    notes = [
        f"{search.tries} steps tried on the updated arm, its frequencies off by three sigma either way",
        "kept is what lowers the residual, tracks and settles as well as the rules' "
        f"({PERCENT * (WORSE - 1):.0f} %), and keeps all margins",
    ]
    return Table("Search", heads, rows, notes)


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 4] + " ..."


def _shaper(proposal: Proposal) -> Table:
    choice = proposal.shaper
    impulses = zip(choice.shaper.delays, choice.shaper.amplitudes, strict=True)
    rows: list[Cells] = [[i + 1, MS * delay, share] for i, (delay, share) in enumerate(impulses)]
    heads = [Column("impulse", "d"), Column("at [ms]", ".1f"), Column("share [1]", ".4f")]
    note = (
        f"for {choice.f_hz:.3f} Hz, damping {PERCENT * choice.zeta:.2f} %: at most "
        f"{PERCENT * choice.left:.1f} % of the vibration is left within +-{PERCENT * choice.band:.2g} %"
    )
    return Table(f"Shaper: {choice.shaper.name}", heads, rows, [note])


def _worth(trials: Pair, unlearned: Pair | None) -> Table:
    heads = [
        Column("on the simulated rig"),
        Column("before", ".4g"),
        Column("after", ".4g"),
        Column("gain\n[dB]", "+.1f"),
    ]
    before, after = trials
    pairs = [("residual acceleration of the tip [m/s^2 RMS]", [t.residual.acceleration for t in trials])]
    if unlearned is not None:
        pairs.append(("... with a law that does not learn", [t.residual.acceleration for t in unlearned]))
    pairs += [
        ("residual distance of the tip [mm RMS]", [MM * t.residual.distance for t in trials]),
        ("largest error of the tip under way [mm]", [MM * t.tracking for t in trials]),
    ]
    rows: list[Cells] = [[name, old, new, -decibels(new, old)] for name, (old, new) in pairs]
    rows.append(["longest settling [s]", before.residual.settling, after.residual.settling, None])
    gains = [-decibels(new, old) for old, new in zip(before.runs, after.runs, strict=True)]
    notes = [
        "the rig is the updated description with more modes; every run is a cold start, first moves count",
        f"{len(gains)} runs, each with noise of its own that nothing was chosen by: "
        f"{min(gains):.1f} to {max(gains):.1f} dB",
    ]
    notes += [
        f"{when}: the arm was not led to the end: {trial.stopped}"
        for when, trial in _both(before, after)
        if trial.stopped
    ]
    return Table("What it is worth", heads, rows, notes)


def _both(before: Trial, after: Trial) -> Sequence[tuple[str, Trial]]:
    return (("before", before), ("after", after))


def _margins(before: Trial, after: Trial) -> Table:
    heads = [Column("path"), Column("gain [dB]\nbefore", ".1f"), Column("\nafter", ".1f")]
    heads += [Column("delay [ms]\nbefore", ".2f"), Column("\nafter", ".2f")]
    rows: list[Cells] = []
    for name in dict.fromkeys([*before.margins, *after.margins]):
        old, new = (trial.margins.get(name) for trial in (before, after))
        cells: list[Cell] = [name.replace("_", " ")]
        for i, factor in ((0, 1.0), (1, MS)):
            cells += [None if pair is None else factor * pair[i] for pair in (old, new)]
        rows.append(cells)
    notes = ["each with its own description, over all frequency errors that the gate looks at"]
    notes += [f"{when}: {trial.trouble}" for when, trial in _both(before, after) if trial.trouble]
    return Table("Margins", heads, rows, notes)
