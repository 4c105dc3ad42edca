"""A picture of the rig as lines for a terminal: spans of text with a colour, cut to its width.

Names, reasons and diagnostics are texts of messages, of anybody: they are drawn as what they are, letters.

The colour says what the word beside it says, too, so nothing is lost without colours.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from flexarm_bringup.monitor.picture import (
    SILENT,
    AxisRow,
    ModeRow,
    Picture,
    SensorRow,
    TopicRow,
)
from flexarm_bringup.printable import printable
from flexarm_model.settings.diagnosis import Level

PLAIN, GOOD, POOR, BAD, FAINT, BOLD = "", "32", "33", "31;1", "2", "1"  # ANSI select graphic rendition
BAR = 24  # characters
NAME = 20  # characters of the column of names, at least
MM, MS = 1e3, 1e3
MOST_TROUBLES = 6
_COLOUR = {"ok": GOOD, "armed": GOOD, "mpc": GOOD, "lqr": GOOD, "pd": GOOD, "nmpc": GOOD, "inactive": POOR}
_COLOUR |= {"degraded": POOR, "starting": POOR, "stopped": POOR, "off": POOR, "stale": POOR}
_COLOUR |= {"lost": BAD, "faulty": BAD, "rejected": BAD, "braking": BAD, "damping": BAD, "hold": BAD}
_OF_LEVEL = {Level.OK: GOOD, Level.WARN: POOR, Level.ERROR: BAD, Level.STALE: POOR}


class Span(NamedTuple):
    """A piece of a line and its colour."""

    text: str
    colour: str = PLAIN


Line = list[Span]
Row = tuple[str, Line]  # the name, and what stands behind it


def draw(picture: Picture) -> list[Line]:
    """Return the frame; parts that nobody speaks of yet say so or are left out."""
    blocks = (_head, _states, _tip, _modes, _axes, _sensors, _troubles, _topics)
    lines: list[Line] = []
    for block in blocks:
        lines += block(picture)
    return lines


def paint(lines: Iterable[Line], width: int, has_colour: bool) -> list[str]:
    """Return lines as text of at most ``width`` characters, with colours or without."""
    return [_painted(line, width, has_colour) for line in lines]


def bar(value: float, limit: float, width: int = BAR) -> str:
    """Return a bar around zero: full to the right at ``limit``, to the left at ``-limit``."""
    half = width // 2
    share = value / limit if limit > 0.0 and math.isfinite(limit) and math.isfinite(value) else 0.0
    cells = round(min(abs(share), 1.0) * half)
    left, right = (cells, 0) if share < 0 else (0, cells)
    return f"{'█' * left:>{half}}│{'█' * right:<{half}}"


def number(value: float, form: str) -> str:
    """Return a number in a format, of the same width where it is not known."""
    text = format(value, form) if math.isfinite(value) else "–"
    return text.rjust(len(format(0.0, form)))


def _head(picture: Picture) -> list[Line]:
    model = f"model {picture.model_id or 'not served yet'}"
    title = Span(f"flexarm  {picture.title or 'nothing heard yet'}", BOLD)
    head = [title, Span(f"   {model}   domain {picture.domain}", FAINT)]
    return [head, [Span(picture.foreign, BAD)]] if picture.foreign else [head]


def _states(picture: Picture) -> list[Line]:
    lines: list[Line] = []
    guard, controller = picture.guard, picture.controller
    if guard is None:
        lines.append([Span("guard       "), Span("silent", BAD)])
    else:
        age = f"command {MS * guard.age:.0f} ms old" if guard.age >= 0.0 else "no command"
        counts = f"passed {guard.passed}  limited {guard.limited}  refused {guard.refused}"
        late = f"late {guard.late}  without command {guard.without_command}"
        lines.append(_state("guard", guard.mode, guard.reason, f"{age}  {counts}  {late}", guard.said))
    if controller is None:
        lines.append([Span("controller  "), Span("silent", BAD)])
    else:
        told = f"solve {MS * controller.solve_time:.2f} ms  missed {controller.missed}"
        told += f"  overruns {controller.overruns}  limits {', '.join(controller.active) or 'none'}"
        said = picture.said("controller_status")
        lines.append(_state("controller", controller.mode, controller.reason, told, said))
    status, reason = picture.estimate or ("silent", "")
    return [*lines, _state("estimate", status, reason, said=picture.said("modal_state"))]


def _state(name: str, mode: str, reason: str, told: str = "", said: float = 0.0) -> Line:
    if said > SILENT:
        reason, mode = f"last said {mode} {said:.0f} s ago", "silent"
    line = [Span(f"{name:10}  "), Span(f"{mode:12}", _COLOUR.get(mode, BAD if mode == "silent" else POOR))]
    line += [Span(f"{reason}  ", POOR)] if reason else []
    return [*line, Span(told, FAINT)]


def _tip(picture: Picture) -> list[Line]:
    tip = picture.tip
    if tip is None:
        return []
    position = " ".join(number(value, "+.4f") for value in tip.position)
    sigma = " ".join(number(MM * value, ".2f") for value in tip.three_sigma)
    line = [Span("tip         "), Span(f"{position} m", BOLD), Span(f"   3 sigma {sigma} mm")]
    if math.isfinite(tip.error):
        inside = tip.error <= math.hypot(*tip.three_sigma)
        line.append(Span(f"   error {MM * tip.error:.3f} mm (against the truth)", GOOD if inside else POOR))
    if math.isfinite(tip.to_goal):
        line.append(Span(f"   to goal {MM * tip.to_goal:.2f} mm"))
    return [line]


def _modes(picture: Picture) -> list[Line]:
    heads = f"{'Hz':>8} {'zeta %':>7} {'at the tip, mm':>15} {'± sigma':>9}"
    return _table(picture, "modes", heads, map(_mode, picture.modes))


def _mode(row: ModeRow) -> Row:
    figures = f"{row.f_hz:8.3f} {100 * row.zeta:7.2f} {number(MM * row.at_tip, '+15.4f')}"
    figures += f" {number(MM * row.sigma, '9.4f')}  "
    return row.name, [Span(figures), Span(bar(row.at_tip, row.largest))]


def _axes(picture: Picture) -> list[Line]:
    heads = f"{'position':>12} {'error':>10}      {'torque':>9} {'':{BAR + 1}} limit"
    return _table(picture, "axes", heads, map(_axis, picture.axes))


def _axis(row: AxisRow) -> Row:
    length, small, force = ("m", "mm", "N") if row.is_linear else ("rad", "mrad", "N m")
    position, error = number(row.position, "+8.4f"), number(1e3 * row.error, "+8.3f")
    figures = f"{position} {length:3} {error} {small:4}"
    share = abs(row.effort) / row.limit
    colour = BAD if share >= 1.0 else POOR if share > 0.9 else GOOD
    limit = f"{row.limit:.4g} {force}" if math.isfinite(row.limit) else f"not known, {force}"
    return row.name, [
        Span(f"{figures} {number(row.effort, '+9.3f')} "),
        Span(bar(row.effort, row.limit), colour),
        Span(f" {limit}", FAINT),
    ]


def _sensors(picture: Picture) -> list[Line]:
    heads = f"{'':9}{'age ms':>7} {'innovation':>11} {'rejected':>9}"
    return _table(picture, "sensors", heads, map(_sensor, picture.sensors))


def _sensor(row: SensorRow) -> Row:
    status = Span(f"{row.status:9}", _COLOUR.get(row.status, PLAIN))
    figures = f"{number(MS * row.age, '7.0f')} {number(row.innovation, '11.2f')} {row.rejected:9d}  "
    return row.name, [status, Span(figures), Span(row.reason, POOR)]


def _topics(picture: Picture) -> list[Line]:
    heads = f"{'Hz':>9} {'jitter ms':>10} {'longest ms':>11}"
    return _table(picture, "topics", heads, map(_topic, picture.heard))


def _topic(row: TopicRow) -> Row:
    jitter, longest = number(MS * row.jitter, "10.2f"), number(MS * row.longest, "11.2f")
    figures = f"{number(row.rate_hz, '9.2f')} {jitter} {longest}"
    silent = f"  silent for {row.age:.0f} s" if row.age > SILENT else ""
    return row.name, [Span(figures), Span(silent, POOR)]


def _troubles(picture: Picture) -> list[Line]:
    troubles = picture.troubles()
    if not picture.verdicts:
        return []
    if not troubles:
        return [[Span("diagnostics "), Span(f"all {len(picture.verdicts)} ok", GOOD)]]
    told = f"  {len(troubles)} of {len(picture.verdicts)} are not ok"
    lines = [[Span(f"{'diagnostics':{_room(picture)}}", BOLD), Span(told, FAINT)]]
    for verdict in troubles[:MOST_TROUBLES]:
        level = Span(f"{verdict.level.name:6}", _OF_LEVEL[verdict.level])
        lines.append([Span("  "), level, Span(f"{verdict.subject}: {verdict.text}")])
    return lines


def _table(picture: Picture, title: str, heads: str, rows: Iterable[Row]) -> list[Line]:
    """Return a title and one line per row, with names in a column that all tables share; nothing without."""
    room = _room(picture)
    lines = [[Span(f"  {name}".ljust(room)), *spans] for name, spans in rows]
    return [[Span(f"{title:{room}}", BOLD), Span(heads, FAINT)], *lines] if lines else []


def _room(picture: Picture) -> int:
    """Return the width of the column of names: a margin, the longest name and a space."""
    tables = (picture.modes, picture.axes, picture.sensors, picture.heard)
    return max([NAME, *(len(row.name) for table in tables for row in table)]) + 3


def _painted(line: Sequence[Span], width: int, has_colour: bool) -> str:
    text, left = "", width
    for span in line:
        shown = printable(span.text[:left])
        left -= len(shown)
        text += f"\x1b[{span.colour}m{shown}\x1b[0m" if has_colour and span.colour and shown else shown
    return text if has_colour else text.rstrip()
