"""Is a case still what it was? Whole, pinned, played again and compared field by field."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.regress.case import EXPECT_FILE, Case, read_case
from flexarm_bringup.regress.pinned import open_pinned
from flexarm_bringup.regress.playing import MODEL, Played, configured, play
from flexarm_bringup.regress.settings_check import check_settings
from flexarm_bringup.replaying.compare import Comparison, Divergence, compare_bags
from flexarm_bringup.replaying.replay_bag import NEEDED, OUTPUTS, configuration
from flexarm_bringup.tick_check import check_ticks

PASSED, DIVERGED, UNUSABLE = 0, 1, 2  # exit codes


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
        _refuse_unreviewed(opened.case)
        played = play(opened.bag)
    except (ValueError, OSError) as error:  # BagError, ConfigError, ParameterError
        return Verdict(folder, UNUSABLE, one_line(error))
    comparison = compare(opened, played)
    code = PASSED if comparison.is_equal else DIVERGED
    reason = "" if comparison.is_equal else str(comparison.divergences[0])
    return Verdict(folder, code, reason, comparison, opened.golden, played.bag, opened.case)


def open_case(folder: Path) -> Opened:
    """Read a case and prove its bags.

    Raises:
        ConfigError, ParameterError: Expectations, description or settings are not understood; a setting
            is of no node.
        BagError: A bag is not whole or not the one that is meant.
    """
    case = read_case(folder)
    bag = configured(open_pinned(case.bag, NEEDED), case)
    golden = open_pinned(case.golden, OUTPUTS[:1])
    configuration(bag)
    check_settings(bag, case)
    check_ticks(bag)
    return Opened(case, bag, golden)


def _refuse_unreviewed(case: Case) -> None:
    """Refuse a case whose tolerances are not those of its last review."""
    if not case.is_reviewed:
        path = case.folder / EXPECT_FILE
        raise BagError(f"{path}: tolerances: not those that golden/ was reviewed with; --update accepts them")


def compare(opened: Opened, played: Played) -> Comparison:
    """Compare what was played with the golden bag, numbers of messages and what was raised included."""
    names = {*opened.case.golden.counts, *played.bag.counts}
    topics = sorted(names, key=lambda name: ((MODEL, *OUTPUTS, name).index(name), name))
    comparison = compare_bags(
        opened.golden, played.bag, topics, opened.case.tolerances, free_end=False
    )  # both are replays
    raised = [_raised(opened, topic, text) for topic, text in played.faults.items()]
    divergences = sorted(
        (*raised, *comparison.divergences), key=lambda item: (item.stamp_ns, item.topic != MODEL)
    )
    return Comparison(comparison.compared, tuple(divergences))


def _raised(opened: Opened, topic: str, text: str) -> Divergence:
    stamps = [record.log_time_ns for record in opened.golden.records if record.name == topic]
    return Divergence(min(stamps, default=0), topic, "", f"no messages any more: {text}")


def one_line(error: Exception) -> str:
    """Return what an error says, in one line."""
    return " ".join(str(error).split()) or type(error).__name__
