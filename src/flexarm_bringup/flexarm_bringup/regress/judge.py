"""Is a case still what it was? Whole, pinned, played again and compared field by field."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from flexarm_bringup.bag_reader import Bag
from flexarm_bringup.bag_writer import BagError
from flexarm_bringup.compare import Comparison, Divergence, compare_bags
from flexarm_bringup.regress.case import Case, open_pinned, read_case
from flexarm_bringup.regress.playing import MODEL, configured, play
from flexarm_bringup.replay_bag import NEEDED, OUTPUTS, configuration
from flexarm_bringup.tick_check import check_ticks

PASSED, DIVERGED, UNUSABLE = 0, 1, 2  # exit codes
# what a fault of the code may raise; of the input everything has been proved before
_FAULTS = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


@dataclass(frozen=True)
class Opened:
    """A case whose bags have been proved whole.

    Attributes:
        case: What is expected.
        bag: What was recorded, with the configuration it is played with.
        golden: What came of it.
    """

    case: Case
    bag: Bag
    golden: Bag


@dataclass(frozen=True)
class Verdict:
    """What became of a case.

    Attributes:
        folder: Of the case.
        code: 0 passed, 1 diverged, 2 cannot be judged.
        reason: One line; empty when it passed.
        comparison: None when there was nothing to compare.
        golden: What was expected; None when the case cannot be judged.
        played: What was found; None when nothing came of it.
        case: None when its expectations are not understood.
    """

    folder: Path
    code: int
    reason: str = ""
    comparison: Comparison | None = None
    golden: Bag | None = None
    played: Bag | None = None
    case: Case | None = None


def judge(folder: Path) -> Verdict:
    """Play a case and compare; whatever is wrong is in the verdict."""
    try:
        opened = open_case(folder)
    except (ValueError, OSError) as error:  # BagError, ConfigError, ParameterError
        return Verdict(folder, UNUSABLE, _line(error))
    try:
        played = play_case(opened)
    except _FAULTS as error:
        text = _line(error) if isinstance(error, BagError) else f"{type(error).__name__}: {_line(error)}"
        first = Divergence(
            opened.golden.records[0].log_time_ns, OUTPUTS[0], "", f"nothing came of it: {text}"
        )
        nothing = Comparison({}, (first,))
        return Verdict(folder, DIVERGED, str(first), nothing, opened.golden, None, opened.case)
    comparison = compare(opened, played)
    code = PASSED if comparison.is_equal else DIVERGED
    reason = "" if comparison.is_equal else str(comparison.divergences[0])
    return Verdict(folder, code, reason, comparison, opened.golden, played, opened.case)


def open_case(folder: Path) -> Opened:
    """Read a case and prove its bags.

    Raises:
        ConfigError, ParameterError: Expectations, description or settings are not understood.
        BagError: A bag is not whole or not the one that is meant.
    """
    case = read_case(folder)
    bag = configured(open_pinned(case.bag, NEEDED), case)
    golden = open_pinned(case.golden, OUTPUTS[:1])
    configuration(bag)
    check_ticks(bag)
    return Opened(case, bag, golden)


def play_case(opened: Opened) -> Bag:
    """Return what today's code makes of a case; raises what ``play`` does."""
    with tempfile.TemporaryDirectory() as scratch:
        return play(opened.bag, Path(scratch) / "played")


def compare(opened: Opened, played: Bag) -> Comparison:
    """Compare what was played with the golden bag, numbers of messages included."""
    names = {*opened.case.golden.counts, *played.counts}
    topics = sorted(names, key=lambda name: ((MODEL, *OUTPUTS, name).index(name), name))
    comparison = compare_bags(opened.golden, played, topics, opened.case.tolerances)
    lost = [item for topic in topics for item in _miscounted(opened, played, topic)]
    told = {item.topic for item in comparison.divergences if not item.field}
    divergences = [*comparison.divergences, *(item for item in lost if item.topic not in told)]
    return Comparison(comparison.compared, tuple(sorted(divergences, key=lambda item: item.stamp_ns)))


def _miscounted(opened: Opened, played: Bag, topic: str) -> list[Divergence]:
    """Name what a comparison by stamps lets pass: the number of messages at the very end."""
    expected, found = opened.case.golden.counts.get(topic, 0), played.counts.get(topic, 0)
    if expected == found:
        return []
    last_ns = opened.golden.records[-1].log_time_ns
    return [Divergence(last_ns, topic, "", f"{found} message(s), {expected} expected")]


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
