"""Propose process and sensor noise for the estimator from a bag, by maximum likelihood.

  flexarm tune BAG                      settings and sigmas before and after, and the YAML to paste
  flexarm tune BAG --html report.html   the same as a page

The first half of the bag is tuned on, the second is held out: what is better in both is better. The
likelihood is that of the innovations of the filter that the settings name, so no truth is needed; where the
bag has it, the tip's error is told, too. "frequency_error" only acts through its product with
"motion_acceleration" and is left alone.

The exit code is 1, and nothing is proposed, when the held-out half became less likely or the tip's error
larger; 0 otherwise; 2 when the bag cannot be used.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.named_arm import add_arm_arguments, arm_named
from flexarm_bringup.consistency.bag_epochs import Epochs, read_epochs
from flexarm_bringup.consistency.knobs import Noise, Parameter
from flexarm_bringup.consistency.recording import Recording, open_recording, run_estimator
from flexarm_bringup.consistency.search import DEAR
from flexarm_bringup.consistency.settled import SETTLING, beginnings, is_settled
from flexarm_bringup.consistency.smoothing import NO_TRUTH, tip_error
from flexarm_bringup.consistency.tuning import Tuned, Tuner
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_estimator.likelihood import Likelihood
from flexarm_model.tree.reduced_tree import ReducedTree

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


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the bag and the report files."""
    parser.add_argument("bag", type=Path, help="folder of a recorded bag")
    add_arm_arguments(parser)
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Tune, compare, report; return the exit code."""
    progress = Progress()
    try:
        progress.say("reading the bag")
        recording = open_recording(args.bag, arm_named(args))
        record = read_epochs(recording)
        tuner = Tuner(record, ReducedTree(recording.config), recording.settings, SETTLING)
        noise = Noise(recording.settings, recording.config.sensors)
        middle = middle_of(record, args.bag, recording.settings.max_gap)
        before = judge(recording, tuner, noise, middle)
        refuse_unlikely(before, args.bag)
        tuned = tuner.tune(noise, middle, progress.say)
        progress.say("comparing")
        choices = [before, judge(recording, tuner, tuned.noise, middle)]
    except ValueError as error:  # BagError; ConfigError or ParameterError of the configuration in the bag
        progress.done()
        print(f"flexarm tune: {error}", file=sys.stderr)
        return UNUSABLE
    progress.done()
    return publish(resting_on(build_page(args.bag, noise, tuned, choices), recording.config), args)


def middle_of(record: Epochs, path: Path, max_gap: float) -> float:
    """Return where the halves of a bag meet [s].

    Raises:
        BagError: One of them would not count, or the bag has a pause.
    """
    t = [epoch.t for epoch in record.epochs]
    begin, end = t[0], t[-1]
    for k in list(beginnings(t, max_gap))[1:]:
        raise BagError(
            f"{path}: {t[k] - t[k - 1]:+.3g} s from one sample to the next at {t[k - 1] - begin:.3f} s: the "
            f"filter begins anew there (max_gap {max_gap:g} s); expected one recording without a pause"
        )
    if end - begin <= 2 * SETTLING:
        raise BagError(
            f"{path}: {end - begin:.2f} s of samples are too short: the first {SETTLING:g} s do not count, "
            f"and each half is to tell something; expected more than {2 * SETTLING:g} s"
        )
    return (begin + end) / 2


def refuse_unlikely(before: Judgement, path: Path) -> None:
    """Raise BagError where a half of a bag cannot be computed at all: nothing could be compared with it."""
    for half, name in ((before.tuned, "first"), (before.held, "second")):
        if not np.isfinite(half.value):
            raise BagError(
                f"{path}: the filter cannot be run through its {name} half, which has a gap, say; expected "
                "one recording without a pause"
            )


def judge(recording: Recording, tuner: Tuner, noise: Noise, middle: float) -> Judgement:
    """Return what a choice of noise is worth; the bag's halves meet at ``middle`` [s]."""
    halves = tuner.likelihood(noise, end=middle), tuner.likelihood(noise, start=middle)
    truth = recording.true_tip()
    if not truth:
        return Judgement(*halves, None)
    sigmas = {spec.name: spec.sigma for spec in noise.sensors}
    told = run_estimator(recording, settings=noise.settings, sigmas=sigmas)
    counts = is_settled(item.estimate for item in told)
    settled = [item for item, one in zip(told, counts, strict=True) if one]
    tip = np.array([item.estimate.T_world_tip[:3, 3] for item in settled])
    error = tip_error([item.stamp_ns for item in settled], tip, truth)
    return Judgement(*halves, error if np.isfinite(error) else None)


def build_page(path: Path, noise: Noise, tuned: Tuned, choices: Sequence[Judgement]) -> Page:
    """Return the proposal, what it is worth, and the YAML."""
    lead = (
        "Maximum likelihood of the filter's innovations over the first half of the bag; "
        f"{tuned.evaluations} runs of the filter."
    )
    items = [parameter_table(tuned.parameters), worth_table(choices), nis_table(choices)]
    checks = worth_checks(choices)
    worse = [f"nothing: {check.name} is {check.found}" for check in checks if not check.passed]
    lines = [] if worse else [*yaml_lines(noise, tuned.noise), *doubtful(tuned.parameters)]
    remarks: dict[str, Sequence[str]] = {
        "YAML to paste": lines or worse or ["nothing: the record does not tell anything better"]
    }
    return Page(f"Noise proposed from {path}", lead, items, checks, remarks, {"yaml": lines})


def parameter_table(parameters: Sequence[Parameter]) -> Table:
    """Return the table of all parameters."""
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
