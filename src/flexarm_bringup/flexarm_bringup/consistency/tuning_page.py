"""What is shown of noise that was proposed: parameters, what they are worth, and the YAML to paste."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexarm_bringup.consistency.knobs import Noise, Parameter
from flexarm_bringup.consistency.search import DEAR
from flexarm_bringup.consistency.smoothing import NO_TRUTH
from flexarm_bringup.consistency.tuning import Tuned
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_estimator.likelihood import Likelihood

MOST_SPREAD = 7.0  # of a logarithm; the record does not tell by which factor of 1000

MICRO = 1e6
VERDICTS = {
    "told": "tells it",
    "less": "tells only that it is less",
    "more": "tells only that it is more",
    "flat": "does not tell it: stays as before",
}


@dataclass(frozen=True)
class Judgement:
    """What a choice of noise is worth.

    Attributes:
        tuned, held: Likelihood of the half that was tuned on, and of the other.
        tip: RMS error of the tip over the bag [m]; None when the bag has no truth for it.
    """

    tuned: Likelihood
    held: Likelihood
    tip: float | None


def build_page(
    path: Path,
    noise: Noise,
    tuned: Tuned,
    choices: Sequence[Judgement],
    stamps: Sequence[Check] = (),
    heard: Sequence[str] = (),
) -> Page:
    """Return the proposal, what it is worth, and the YAML.

    Args:
        path: The bag.
        noise: Before.
        tuned: What was found.
        choices: What noise before and after are worth.
        stamps: Whether the cameras stamp as late as the filter takes them to; if not, nothing is proposed.
        heard: Which samples were taken otherwise than they are, a line each.
    """
    lead = (
        "Maximum likelihood of the filter's innovations over the first half of the bag; "
        f"{tuned.evaluations} runs of the filter."
    )
    items = [parameter_table(tuned.parameters, heard), worth_table(choices), nis_table(choices)]
    checks = [*worth_checks(choices), *stamps]
    worse = [f"nothing: {check.name} is {check.found}" for check in checks if not check.passed]
    lines = [] if worse else [*yaml_lines(noise, tuned.noise), *doubtful(tuned.parameters)]
    remarks: dict[str, Sequence[str]] = {
        "YAML to paste": lines or worse or ["nothing: the record does not tell anything better"]
    }
    return Page(f"Noise proposed from {path}", lead, items, checks, remarks, {"yaml": lines})


def parameter_table(parameters: Sequence[Parameter], heard: Sequence[str] = ()) -> Table:
    """Return the table of all parameters, and how samples were ``heard``."""
    heads = [Column("parameter"), Column("unit"), Column("before", ".3g"), Column("after", ".3g")]
    heads += [Column("uncertain\nby factor", ".2f"), Column("the record")]
    rows: list[Cells] = [
        [
            each.name, each.unit, each.before, None if each.verdict == "flat" else each.after,
            float(np.exp(each.spread)) if each.spread < MOST_SPREAD else None,
            VERDICTS[each.verdict],
        ]
        for each in parameters
    ]  # fmt: skip
    notes = [
        "uncertain: one sigma of the logarithm, from the curvature of the likelihood; the search goes as far "
        "as a factor of 100",
        "what is less certain than by a factor of e, or ends at the limit of the search, is put back, and "
        f"the others are searched again: it stays so where that costs at most {DEAR:g} of log-likelihood",
        "a bag shows what happened in it: it does not show what else the settings are to bear (payloads, "
        "less stiffness)",
        "sensors that share kind and sigma share a parameter",
        "acceleration_error and strain_error add to the sigmas as before",
        *heard,
    ]
    return Table("Parameters", heads, rows, notes)


def worth_table(choices: Sequence[Judgement]) -> Table:
    """Return the table of likelihoods and tip errors, before and after."""
    before, after = choices
    heads = [Column(""), Column("before", ".1f"), Column("after", ".1f"), Column("change", "+.1f")]
    rows: list[Cells] = [
        [f"log-likelihood, {name}", old.value, new.value, new.value - old.value]
        for name, old, new in (
            ("first half (tuned on)", before.tuned, after.tuned),
            ("second half (held out)", before.held, after.held),
        )
    ]
    if before.tip is not None and after.tip is not None:
        rows.append(
            ["tip error [um RMS]", MICRO * before.tip, MICRO * after.tip, MICRO * (after.tip - before.tip)]
        )
    return Table("What it is worth", heads, rows, [] if len(rows) > 2 else [f"no tip error: {NO_TRUTH}"])


def worth_checks(choices: Sequence[Judgement]) -> list[Check]:
    """Return whether what was not tuned on is as good as before."""
    before, after = choices
    old, new = before.held.value, after.held.value
    found = f"{new:.2f}, {old:.2f} before"
    kept = bool(np.isfinite(new) and new >= old)
    checks = [Check("log-likelihood, second half (held out)", "no less than before", found, kept)]
    if before.tip is not None and after.tip is not None:
        found = f"{MICRO * after.tip:.2f} um RMS, {MICRO * before.tip:.2f} before"
        checks.append(Check("tip error", "no more than before", found, after.tip <= before.tip))
    return checks


def nis_table(choices: Sequence[Judgement]) -> Table:
    """Return the table of mean normalised innovations squared per sensor."""
    before, after = choices
    pairs = [each.nis() for each in (before.tuned, after.tuned, before.held, after.held)]
    titles = ("first half\nbefore", "after", "second half\nbefore", "after")
    heads = [Column("sensor"), *(Column(title, ".2f") for title in titles)]
    rows: list[Cells] = [[name, *(pair.get(name) for pair in pairs)] for name in pairs[0]]
    return Table("NIS per number", heads, rows, ["1 is right; more: the noise is told too low"])


def yaml_lines(before: Noise, after: Noise) -> list[str]:
    """Return what to change in moves file (settings.estimator) and description (sensors)."""
    names = [
        name
        for name in vars(after.settings)
        if getattr(after.settings, name) != getattr(before.settings, name)
    ]
    values = ", ".join(f"{name}: {getattr(after.settings, name):.3g}" for name in names)
    lines = [f"settings: {{estimator: {{{values}}}}}"] if names else []
    for old, new in zip(before.sensors, after.sensors, strict=True):
        factor = float(new.sigma[0] / old.sigma[0])
        if factor != 1.0:
            sigma = ", ".join(f"{value:.3g}" for value in new.sigma)
            lines.append(f"sensors.{new.name}.sigma: {factor:.3g} times what it is: [{sigma}] in SI")
    return lines


def doubtful(parameters: Sequence[Parameter]) -> list[str]:
    """Return a comment for each value to paste of which the record tells the direction alone."""
    return [
        f"# {one.name}: the record {VERDICTS[one.verdict]} than {one.before:.3g}, not by how much"
        for one in parameters
        if one.verdict in ("less", "more")
    ]
