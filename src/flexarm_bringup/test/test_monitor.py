"""The monitor's frame: what it says, how it is cut, and a terminal that is left as it was."""

from __future__ import annotations

import io
import math
import re
from dataclasses import replace

import pytest

from flexarm_bringup import cli
from flexarm_bringup.monitor.drawing import BAR, Line, bar, draw, number, paint
from flexarm_bringup.monitor.picture import (
    UNKNOWN,
    AxisRow,
    ControllerRow,
    GuardRow,
    ModeRow,
    Picture,
    SensorRow,
    TipRow,
    TopicRow,
)
from flexarm_bringup.monitor.screen import ENTER, LEAVE, Screen
from flexarm_model.settings.diagnosis import Level, Verdict

ANSI = re.compile(r"\x1b\[[0-9;]*m")
FULL = Picture(
    title="single_link geared",
    model_id="0123456789abcdef",
    domain="7",
    estimate=("degraded", "camera: stale"),
    guard=GuardRow("armed", "", 0.004, 1000, 2, 3, 4, 5, 0.05),
    controller=ControllerRow("mpc", "", 2.1e-4, 0, 1, ("torque:base.rz",)),
    tip=TipRow((0.64, -0.001, 0.0), (1e-4, 2e-4, 0.0), error=5e-5, to_goal=0.002),
    modes=(ModeRow("mode_1", 5.23, 0.015, -1e-3, 2e-5, 2e-3),),
    axes=(AxisRow("base.rz", 0.5, 1e-4, 14.0, 28.0), AxisRow("slide.tx", 0.1, 1e-3, 5.0, is_linear=True)),
    sensors=(SensorRow("camera", "stale", "silent for 0.3 s", 0.31, 1.0, 7),),
    topics=(TopicRow("strain", 200.0, 1e-4, 6e-3, 0.002), TopicRow("reference", *[math.nan] * 4)),
    verdicts=(Verdict("rig: loop", Level.OK, "ok"), Verdict("estimator: camera", Level.STALE, "silent")),
)


def text(picture: Picture, width: int = 200) -> str:
    return "\n".join(paint(draw(picture), width, has_colour=False))


def test_a_frame_says_everything_that_is_known() -> None:
    shown = text(FULL)
    for said in (
        "single_link geared", "0123456789abcdef", "armed", "command 4 ms old", "refused 3", "mpc",
        "torque:base.rz", "degraded", "camera: stale", "+0.6400 -0.0010 +0.0000 m", "error 0.050 mm",
        "3 sigma 0.10 0.20 0.00 mm", "to goal 2.00 mm", "5.230", "1.50", "28 N m", "silent for 0.3 s",
        "200.00", "1 of 2 are not ok",
    ):  # fmt: skip
        assert said in shown, said


def test_a_rig_of_which_nothing_is_known_is_silent_and_no_error() -> None:
    shown = text(Picture())
    assert shown.count("silent") == 3 and "nothing heard yet" in shown


def test_a_tip_that_is_no_number_is_a_dash_as_other_numbers_are() -> None:
    """It was "+nan"."""
    shown = text(replace(FULL, tip=TipRow((UNKNOWN, 0.5, 0.0), (UNKNOWN, 2e-4, 0.0))))
    assert "nan" not in shown
    assert "      – +0.5000 +0.0000 m   3 sigma    – 0.20 0.00 mm" in shown


HOSTILE = (
    "a\x1b[2J\x07b\r\nc\t\u202e\ud800"  # clears a screen, rings, goes on in another line, runs backwards
)


def test_no_text_of_a_message_does_anything_to_the_terminal_but_stand_in_its_line() -> None:
    """Names and texts of /diagnostics cleared it, set its title and broke lines."""
    assert FULL.guard is not None and FULL.controller is not None
    hostile = replace(
        FULL,
        title=HOSTILE,
        model_id=HOSTILE,
        foreign=HOSTILE,
        estimate=("degraded", HOSTILE),
        guard=replace(FULL.guard, reason=HOSTILE),
        controller=replace(FULL.controller, mode=HOSTILE, reason=HOSTILE, active=(HOSTILE,)),
        modes=(replace(FULL.modes[0], name=HOSTILE),),
        axes=(replace(FULL.axes[0], name=HOSTILE),),
        sensors=(replace(FULL.sensors[0], name=HOSTILE, reason=HOSTILE),),
        topics=(replace(FULL.topics[0], name=HOSTILE),),
        verdicts=(Verdict(HOSTILE, Level.ERROR, HOSTILE),),
    )
    for has_colour in (False, True):
        lines = paint(draw(hostile), 300, has_colour)
        assert all(ANSI.sub("", line).isprintable() for line in lines)
    told = "a?[2J?b  c ??"
    assert f"ERROR {told}: {told}" in text(hostile)
    assert f"  {told}".ljust(23) + "stale" in text(hostile)  # in its column


def test_topics_that_never_spoke_are_left_out() -> None:
    assert "strain" in text(FULL) and "reference" not in text(FULL)


def test_a_limit_that_is_not_known_is_told_as_such_in_the_axis_own_unit() -> None:
    line = next(line for line in text(FULL).split("\n") if "slide.tx" in line)
    assert "not known, N" in line and " mm " in line and "█" not in line


def test_a_guard_that_has_fallen_silent_is_not_told_as_armed() -> None:
    old = Picture(guard=GuardRow("armed", "", 0.0, 0, 0, 0, 0, 0, said=12.0))
    assert re.search(r"guard +silent +last said armed 12 s ago", text(old))


def test_a_controller_or_an_estimator_that_has_fallen_silent_is_not_told_as_good() -> None:
    """It was "ok" and "mpc" for good while their processes stood."""
    old = [
        replace(row, age=7.0) for row in FULL.topics if row.name not in ("modal_state", "controller_status")
    ]
    old += [TopicRow(name, UNKNOWN, UNKNOWN, UNKNOWN, 7.0) for name in ("modal_state", "controller_status")]
    shown = text(replace(FULL, topics=tuple(old)))
    assert re.search(r"controller +silent +last said \w+ 7 s ago", shown)
    assert re.search(r"estimate +silent +last said \w+ 7 s ago", shown)


def test_columns_stand_below_their_heads_whatever_the_names_are() -> None:
    name = "forearm_accelerometer_at_the_wrist"
    sensors = (*FULL.sensors, SensorRow(name, "ok", "", 0.01, 0.5, 0))
    topics = (*FULL.topics, TopicRow(f"imu/{name}", 200.0, 1e-4, 6e-3, 0.002))
    for shown in (FULL, replace(FULL, sensors=sensors), replace(FULL, topics=topics)):
        lines = text(shown).split("\n")
        for head, rows in (("age ms", shown.sensors), ("jitter ms", shown.heard), ("zeta %", shown.modes)):
            title = next(line for line in lines if head in line)
            end = title.index(head) + len(head)
            below = [next(line for line in lines if line.startswith(f"  {row.name} ")) for row in rows]
            assert below and all(line[end - 1].isdigit() and line[end] == " " for line in below)


def test_a_description_of_another_arm_is_told_below_the_title() -> None:
    told = "another arm runs: 'single_link', config 12, not my.yaml: 'my', config 34"
    assert text(replace(FULL, foreign=told)).split("\n")[1] == told
    assert "another arm" not in text(FULL)


@pytest.mark.parametrize("width", [20, 80, 110])
def test_no_line_is_wider_than_the_terminal_and_colours_add_no_width(width: int) -> None:
    plain, coloured = (paint(draw(FULL), width, has_colour=colour) for colour in (False, True))
    assert max(map(len, plain)) <= width
    assert [ANSI.sub("", line).rstrip() for line in coloured] == plain
    assert any("\x1b[" in line for line in coloured)


@pytest.mark.parametrize(
    ("value", "filled"), [(0.0, (0, 0)), (28.0, (0, 12)), (-28.0, (12, 0)), (99.0, (0, 12)), (7.0, (0, 3))]
)
def test_bars_are_full_at_the_limit_on_their_side(value: float, filled: tuple[int, int]) -> None:
    left, right = bar(value, 28.0).split("│")
    assert (left.count("█"), right.count("█")) == filled
    assert len(left) == len(right) == BAR // 2


def test_numbers_that_are_not_known_take_as_much_room() -> None:
    assert len(number(math.nan, "+9.3f")) == len(number(1.5, "+9.3f")) == 9


class Terminal(io.StringIO):
    """Stands in for one."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("end", [KeyboardInterrupt, ValueError])
def test_the_terminal_is_given_back_however_the_monitor_ends(
    end: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    out = Terminal()
    with pytest.raises(end), Screen(out) as screen:
        screen.show(["one", "two"])
        raise end
    assert out.getvalue().startswith(ENTER) and out.getvalue().endswith(LEAVE)


def test_a_frame_is_never_longer_than_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("LINES", "5")
    out = Terminal()
    with Screen(out) as screen:
        screen.show([str(k) for k in range(40)])
    assert out.getvalue().count("\r\n") == 4


@pytest.mark.parametrize(
    ("lines", "last"), [(4, "3"), (5, "... 2 more lines"), (40, "... 37 more lines")], ids=str
)
def test_a_frame_that_is_cut_says_how_many_lines_are_missing(
    lines: int, last: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was below was cut without a hint."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("LINES", "5")
    out = Terminal()
    with Screen(out) as screen:
        screen.show([str(k) for k in range(lines)])
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", out.getvalue()).split("\r\n")
    assert shown[:3] == ["0", "1", "2"] and shown[3] == last


def test_troubles_stand_in_a_terminal_of_24_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """They stood below a dozen topics, where nobody saw them."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("LINES", "24")
    topics = tuple(TopicRow(f"topic {k}", 200.0, 1e-4, 6e-3, 0.002) for k in range(13))
    out = Terminal()
    with Screen(out) as screen:
        screen.show(paint(draw(replace(FULL, topics=topics)), 110, has_colour=False))
    assert "STALE estimator: camera: silent" in out.getvalue() and "more lines" in out.getvalue()


def test_without_a_terminal_frames_are_plain_text() -> None:
    out = io.StringIO()
    with Screen(out) as screen:
        screen.show(paint([Line()], 80, screen.has_colour))
        screen.show(["text"])
    assert "\x1b" not in out.getvalue()


def test_a_domain_that_is_none_is_told_instead_of_a_rig_that_is_silent(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "300")
    assert cli.main(["monitor", "--once", "--wait", "1"]) == 2
    error = capsys.readouterr().err
    assert error == "flexarm monitor: ROS_DOMAIN_ID: '300': expected a whole number, 0 to 232\n"


def test_a_description_that_is_not_there_is_told_before_the_rig_is_looked_for(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert cli.main(["monitor", "--once", "no/such/arm.yaml"]) == 2
    assert "no/such/arm.yaml: cannot be read" in capsys.readouterr().err
