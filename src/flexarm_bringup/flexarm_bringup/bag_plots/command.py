"""Plot a bag: tip, axes, torques, modes, strain, sensors, the controller's rungs, times and energies.

  flexarm plot BAG                        one page with all panels that the bag has topics for, ./NAME.html
  flexarm plot BAG --html FILE            the same into FILE
  flexarm plot BAG --png DIR              one picture per panel into a folder instead
  flexarm plot BAG --topics strain /imu   only what concerns these topics; any topic, also of other robots

Topics are relative to /flexarm unless they begin with a slash. Lines and strips are blank where a topic of a
steady pace fell silent for more than five of its usual steps and 0.1 s. What the bag lacks is said, and why a
panel is left out whose messages are not as they should be. A bag of another robot has its numbers drawn,
topic by topic. Exit code 2 and the reason when a bag cannot be used, none of it be drawn, or a picture not be
written.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

from flexarm_bringup.arguments import output_folder
from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.bag_plots.fields_panel import fields_panel
from flexarm_bringup.bag_plots.panel import Panel
from flexarm_bringup.bag_plots.panels import PANELS
from flexarm_bringup.bag_plots.series import BagSeries
from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish

WIDTH = 9.0  # inch
DPI = 110
MOST_FOREIGN = 12  # topics of another robot's bag that are drawn unasked
# what a panel may raise whose messages lack elements, or do not belong together
ODD = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)

Drawn = TypeVar("Drawn")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the bag, the topics and where to write."""
    parser.add_argument("bag", type=Path, help="folder of a recorded bag")
    parser.add_argument(
        "--topics", nargs="+", default=[], metavar="TOPIC", help="only panels of these topics"
    )
    parser.add_argument("--png", type=output_folder, metavar="DIR", help="folder for one picture per panel")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Draw, write, say what is missing; return the exit code."""
    try:
        series = BagSeries(check_bag(args.bag))
        panels = choose(series, args.topics)
    except ValueError as error:  # BagError
        print(f"flexarm plot: {error}", file=sys.stderr)
        return UNUSABLE
    if not args.png and not args.html:
        args.html = Path(f"{args.bag.resolve().name}.html")
    failed: dict[str, str] = {}
    try:
        if args.png:
            failed |= draw_each(panels, lambda panel: write_picture(panel, series, args.png))[1]
        figures, more = draw_each(panels if args.html else (), lambda panel: draw(panel, series))
    except OSError as error:  # a full disk, say
        print(f"flexarm plot: {args.png}: cannot be written ({error.strerror})", file=sys.stderr)
        return UNUSABLE
    failed |= more
    if len(failed) == len(panels):
        reasons = "; ".join(f"{name}: {reason}" for name, reason in failed.items())
        print(f"flexarm plot: {series.path}: nothing of it can be drawn: {reasons}", file=sys.stderr)
        return UNUSABLE
    arms = [series.config] if series.config else []  # a bag of another robot has none
    return publish(resting_on(build_page(series, panels, figures, failed), *arms), args)


def choose(series: BagSeries, topics: Sequence[str]) -> list[Panel]:
    """Return the panels that a bag has messages for.

    Args:
        series: The bag.
        topics: Only those that concern these; none: all.

    Raises:
        BagError: It has none of the topics asked for, or nothing that can be drawn.
    """
    absent = [topic for topic in topics if not series.has(topic)]
    if absent:
        known = ", ".join(sorted(name for name, count in series.counts.items() if count))
        raise BagError(f"{series.path}: no message on {', '.join(absent)}; it has {known}")
    wanted = {name for topic in topics for name in series.topics(topic)}
    ready = [panel for panel in PANELS if not panel.missing(series)]
    if wanted:
        ready = [panel for panel in ready if wanted & _names(panel, series)]
    drawn = {name for panel in ready for name in _names(panel, series)}
    others = sorted(wanted - drawn) if wanted or ready else sorted(n for n, c in series.counts.items() if c)
    more = [fields_panel(name, series) for name in others[: len(wanted) or MOST_FOREIGN]]
    ready += [panel for panel in more if panel is not None]
    if not ready:
        raise BagError(f"{series.path}: holds nothing that can be drawn")
    return ready


def build_page(
    series: BagSeries, panels: Sequence[Panel], figures: Sequence[Figure], failed: Mapping[str, str]
) -> Page:
    """Return the page: the figures, what is missing, and why panels could not be drawn, by their names."""
    counted = sum(series.counts.values())
    arm = f" of {series.config.name} ({series.config.preset or 'no preset'})" if series.config else ""
    lead = f"{counted} messages{arm}. Time zero is the first estimate, or the first measurement without one. "
    lead += "Blank: a topic that comes at a steady pace fell silent."
    rows: list[Cells] = []
    for panel in [*PANELS, *(panel for panel in panels if panel not in PANELS)]:
        became = "drawn" if panel in panels else "left out"
        if panel.name in failed:
            became = f"left out: {failed[panel.name]}"
        rows.append([panel.name, ", ".join(panel.missing(series)) or "-", became])
    table = Table("Panels", [Column("panel"), Column("topics missing"), Column("")], rows)
    return Page(f"Bag {series.path.name}", lead, [*figures, table])


def draw_each(
    panels: Sequence[Panel], action: Callable[[Panel], Drawn]
) -> tuple[list[Drawn], dict[str, str]]:
    """Return what could be drawn, and the reasons of the other panels by their names."""
    drawn, failed = list[Drawn](), dict[str, str]()
    for panel in panels:
        try:
            drawn.append(action(panel))
        except ODD as error:
            text = " ".join(str(error).split())
            failed[panel.name] = text if isinstance(error, BagError) else f"{type(error).__name__}: {text}"
    return drawn, failed


def draw(panel: Panel, series: BagSeries) -> Figure:
    """Return a panel as a figure of the page."""
    with drawing(WIDTH, panel.height) as plot:
        panel.draw(plot, series)
        return to_figure(plot, panel.title)


def write_picture(panel: Panel, series: BagSeries, folder: Path) -> Path:
    """Write the picture of a panel, dark on white, into a folder that is made; return its path.

    Raises:
        OSError: It cannot be written; nothing of it is left.
    """
    path = folder / f"{panel.name}.png"
    folder.mkdir(parents=True, exist_ok=True)
    with drawing(WIDTH, panel.height) as plot:
        panel.draw(plot, series)
        plot.suptitle(panel.title, fontsize=10)
        try:
            plot.savefig(path, dpi=DPI, facecolor="white")
        except OSError:
            path.unlink(missing_ok=True)
            raise
    return path


def _names(panel: Panel, series: BagSeries) -> set[str]:
    return {name for topic in (*panel.topics, *panel.uses) for name in series.topics(topic)}
