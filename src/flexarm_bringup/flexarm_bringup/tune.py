"""Propose process and sensor noise for the estimator from a bag, by maximum likelihood.

  flexarm tune BAG                      settings and sigmas before and after, and the YAML to paste
  flexarm tune BAG --html report.html   the same as a page

The first half of the bag is tuned on, the second is held out: what is better in both is better. The
likelihood is that of the innovations of the filter that the settings name, so no truth is needed; where the
bag has it, the tip's error is told, too. "frequency_error" only acts through its product with
"motion_acceleration" and is left alone.

Samples that the estimator would refuse, outside their range say, are left out and counted. A sensor that it
puts out of use on the way counts all the same, and is named. Frames count at the instant that
"calibrate_latency" finds. Where a camera stamps later than the estimator takes it to, write its "stamp_delay"
first: its noise would be told too large.

The exit code is 1, and nothing is proposed, when the held-out half became less likely, the tip's error
larger, or a camera's stamps are not as late as told; 0 otherwise; 2 when the bag cannot be used.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.named_arm import add_arm_arguments, arm_named
from flexarm_bringup.consistency.bag_epochs import Epochs, read_epochs
from flexarm_bringup.consistency.first_hearing import hear
from flexarm_bringup.consistency.knobs import Noise
from flexarm_bringup.consistency.late_stamps import delays_in_use
from flexarm_bringup.consistency.recording import Recording, open_recording, run_estimator
from flexarm_bringup.consistency.settled import SETTLING, beginnings, is_settled
from flexarm_bringup.consistency.smoothing import tip_error
from flexarm_bringup.consistency.tuning import Tuner
from flexarm_bringup.consistency.tuning_page import Judgement, build_page
from flexarm_bringup.consistency.usable_samples import own_words
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.report import add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_model.tree.reduced_tree import ReducedTree


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
        progress.say("looking how late the cameras stamp, and who is at fault")
        first = hear(recording)
        late = first.late
        delays = delays_in_use(late, recording.settings.calibrate_latency)
        record = read_epochs(recording, delays)
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
    stamps = [each.check(delays) for each in late]
    heard = [*record.remarks, *own_words(record.own), *(each.describe() for each in late if delays)]
    heard += first.describe()
    page = build_page(args.bag, noise, tuned, choices, stamps, heard)
    return publish(resting_on(page, recording.config), args)


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
                f"{path}: the filter cannot be run through its {name} half: at some instant it diverges, or "
                "the loops of the arm do not close where it says the arm to be; does the description fit?"
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
