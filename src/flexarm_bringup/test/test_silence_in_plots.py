"""Plots leave blank when nobody spoke, and put a message without a stamp where it came."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from bag_fixture import joint_state, modal_state
from test_bag_plots import PERIOD_NS, make

from flexarm_bringup.bag_plots.control_panels import draw_rungs
from flexarm_bringup.bag_plots.estimate_panels import draw_modes
from flexarm_bringup.bag_plots.motion_panels import _draw_distance, draw_goals
from flexarm_bringup.bag_plots.panel import band, line
from flexarm_bringup.bag_plots.series import STRETCHES, BagSeries, spells
from flexarm_bringup.bag_plots.silence import gaps, is_silent
from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.bag_writer import BagWriter
from flexarm_bringup.page.figures import drawing
from flexarm_bringup.topics import STREAMS

S = 10**9
STEADY = np.arange(100) * 0.005
BROKEN = np.append(STEADY, STEADY + 14.5)  # silent from 0.5 to 14.5 s
BAGGED = {s.topic: s for s in STREAMS if s.topic in ("joint_states", "modal_state", "guard_status")}


def recorded(path: Path, start_ns: int, lag_ns: int = 0, silent: range = range(0)) -> BagSeries:
    """A run of 2 s from a stamp on, recorded later by a lag; the guard spoke unstamped for 1 s before."""
    with BagWriter(path, tuple(BAGGED.values()), {"git": "0" * 40}) as writer:

        def write(topic: str, cdr: bytes, at_ns: int) -> None:
            writer.write(BAGGED[topic].name, at_ns + lag_ns, cdr)

        kind = BAGGED["guard_status"].type
        for k in range(10):
            write("guard_status", make(kind, 0, mode=0), start_ns - S + k * S // 10)
        for k in range(400):
            stamp = start_ns + k * PERIOD_NS
            if k % 20 == 0:
                write("guard_status", make(kind, stamp, mode=1), stamp)
            if k not in silent:
                write("modal_state", modal_state(stamp), stamp)
            write("joint_states", joint_state(stamp, 0.0), stamp)
    return BagSeries(check_bag(path))


def test_a_message_without_a_stamp_is_drawn_when_it_came(tmp_path: Path) -> None:
    """The guard stamps nothing before it hears the drives; its strip began in 1970."""
    series = recorded(tmp_path / "bag", 1_795_954_574 * S)
    t = series.times("guard_status")
    assert t[:10] == pytest.approx(np.arange(10) * 0.1 - 1.0) and t[10] == 0.0
    assert [msg.mode for msg in series.messages("guard_status")] == [0] * 10 + [1] * 20
    with drawing() as plot:
        draw_rungs(plot, series)
        low, high = plot.axes[0].get_xlim()
    assert -1.5 < low < -1.0 and 2.0 < high < 2.5


def test_drives_whose_clock_is_not_the_recorders_have_unstamped_messages_in_their_own_time(
    tmp_path: Path,
) -> None:
    series = recorded(tmp_path / "bag", 5 * S, lag_ns=1_795_954_574 * S)
    assert series.times("guard_status")[:10] == pytest.approx(np.arange(10) * 0.1 - 1.0)


def test_zero_is_a_time_in_a_run_that_counts_from_zero(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", (BAGGED["modal_state"],), {"git": "0" * 40}) as writer:
        for k in range(5):
            writer.write(BAGGED["modal_state"].name, S + k, modal_state(k * PERIOD_NS))
    t = BagSeries(check_bag(tmp_path / "bag")).times("modal_state")
    assert t == pytest.approx(np.arange(5) * 0.005)


def test_a_topic_without_any_stamp_is_drawn_by_arrival(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag", (BAGGED["joint_states"],), {"git": "0" * 40}) as writer:
        for k in range(5):
            writer.write(BAGGED["joint_states"].name, 3 * S + k * S, joint_state(0, 0.0))
    t = BagSeries(check_bag(tmp_path / "bag")).times("joint_states")
    assert t == pytest.approx(np.arange(5.0))


def test_a_spell_ends_one_step_after_the_last_message_before_a_silence() -> None:
    told = spells(BROKEN, ["ok"] * 200)
    assert [(start, length) for start, length, _ in told] == [
        (0.0, pytest.approx(0.5)),
        (14.5, pytest.approx(0.5)),
    ]
    assert spells(BROKEN, ["ok"] * 200, holds=True) == [(0.0, pytest.approx(15.0), "ok")]


def test_a_line_is_broken_where_the_topic_was_silent_also_when_it_is_thinned() -> None:
    many = np.arange(8 * STRETCHES) * 0.005
    for t in (BROKEN, np.append(many, many + many[-1] + 0.2)):
        with drawing() as plot:
            axes = plot.subplots()
            line(axes, t, np.sin(t))
            shown_t, shown = axes.lines[0].get_data()
        (at,) = np.flatnonzero(np.isnan(shown))
        k = t.size // 2
        assert shown_t[at - 1] <= t[k - 1] and shown_t[at + 1] >= t[k]
        assert np.isfinite(shown).sum() <= 4 * STRETCHES


def test_a_band_is_in_two_pieces_of_one_colour_around_a_silence() -> None:
    with drawing() as plot:
        axes = plot.subplots()
        band(axes, BROKEN, np.sin(BROKEN) - 1, np.sin(BROKEN) + 1, color="C0", label="3 sigma")
        before, after = axes.patches
        assert before.get_xy()[:, 0].max() <= 0.5 and after.get_xy()[:, 0].min() >= 14.5
        assert before.get_facecolor() == after.get_facecolor()
        assert [text.get_text() for text in axes.legend().get_texts()] == ["3 sigma"]


def test_an_estimator_that_fell_silent_is_drawn_neither_healthy_nor_known(tmp_path: Path) -> None:
    series = recorded(tmp_path / "bag", 5 * S, silent=range(100, 300))  # 0.5 to 1.5 s
    with drawing() as plot:
        draw_modes(plot, series)
        for axes in plot.axes:
            assert len(axes.patches) == 2 and np.isnan(axes.lines[0].get_ydata()).sum() == 1
    with drawing() as plot:
        draw_rungs(plot, series)
        boxes = [path.get_extents() for c in plot.axes[-1].collections for path in c.get_paths()]
    assert [(box.x0, box.x1) for box in boxes] == [pytest.approx((0.0, 0.5)), pytest.approx((1.5, 2.0))]


def test_the_distance_to_the_reference_is_not_known_where_the_estimate_is_silent() -> None:
    t = np.linspace(0.0, 20.0, 401)
    curves = {"estimate": (BROKEN, np.ones((200, 3))), "reference": (t, np.zeros((401, 3)))}
    with drawing() as plot:
        axes = plot.subplots()
        _draw_distance(axes, curves)
        shown_t, shown = axes.lines[0].get_data()
    known = shown_t[np.isfinite(shown)]
    assert np.all((known <= 0.5) | ((known >= 14.5) & (known <= 15.0))) and known.size >= 20


def test_messages_that_are_rare_or_come_in_bursts_are_no_silence() -> None:
    assert not gaps(np.array([0.0, 7.0, 7.1, 30.0])).any()
    bursts = np.concatenate([start + np.arange(4) * 0.01 for start in (0.0, 3.0, 9.0, 20.0)])
    assert not gaps(bursts).any()
    assert not gaps(
        np.arange(10) * 0.005 + np.arange(10) // 5 * 0.09
    ).any()  # shorter than a tenth of a second
    assert not gaps(np.zeros(0)).any() and not gaps(np.zeros(1)).any() and not gaps(np.zeros(3)).any()
    assert np.flatnonzero(gaps(BROKEN)).tolist() == [99]
    assert is_silent(BROKEN, np.array([-0.1, 0.0, 0.498, 0.6, 14.5, 14.9, 15.1])).tolist() == [
        True, False, False, True, False, False, True,
    ]  # fmt: skip


def test_what_became_of_a_goal_holds_until_the_next_one() -> None:
    """A status comes at 20 Hz in a move and never after it."""
    t = np.append(np.arange(20) * 0.05, 19.0)
    message = type("Message", (SimpleNamespace,), {"SUCCEEDED": 2})
    messages = [message(state=2, distance=0.0)] * t.size
    series = SimpleNamespace(
        messages=lambda topic: messages, times=lambda topic: t, column=lambda *_: np.zeros(t.size)
    )
    with drawing() as plot:
        draw_goals(plot, series)
        (strip,) = plot.axes[0].collections
        box = strip.get_paths()[0].get_extents()
    assert box.x0 == 0.0 and box.x1 >= 19.0
