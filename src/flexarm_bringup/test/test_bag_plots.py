"""Plots straight from a bag: every panel that its topics allow, the missing ones named, no peak lost."""

import argparse
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from bag_fixture import joint_state, modal_state, stamped_header
from scipy.interpolate import CubicSpline

from flexarm_bringup.bag_plots.command import add_arguments, choose, run
from flexarm_bringup.bag_plots.control_panels import draw_limits
from flexarm_bringup.bag_plots.motion_panels import asked, references
from flexarm_bringup.bag_plots.panel import reach
from flexarm_bringup.bag_plots.panels import PANELS
from flexarm_bringup.bag_plots.series import STRETCHES, BagSeries, spells, thin
from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagWriter
from flexarm_bringup.page.figures import drawing
from flexarm_bringup.topics import STREAMS

PERIOD_NS = 5_000_000
FOREIGN = Path(__file__).parents[3] / "tests" / "recorded" / "mobile_robot"
ZERO_NS = 3 * 10**9
BAGGED = ("joint_states", "modal_state", "controller_status", "motion_status", "reference")


def make(kind: str, stamp_ns: int, **fields: object) -> bytes:
    """Return a message of a type with the defaults of its fields, changed where told."""
    types = bag_types()
    definition = types.types[kind]
    empty = {"string": "", "float64": 0.0, "bool": False}
    values = {}
    for name, (category, about) in types.fielddefs[kind][1]:
        base = about[0] if isinstance(about, tuple) else about
        values[name] = np.zeros(0) if category > 2 and "float" in str(base) else empty.get(base, 0)
        values[name] = [] if category > 2 and "float" not in str(base) else values[name]
    values.update(header=stamped_header(stamp_ns), **fields)
    return bytes(types.serialize_cdr(definition(**values), kind))


def reference(stamp_ns: int) -> bytes:
    """A line from 0.2 to 0.4 in 20 ms."""
    types = bag_types()
    point = types.types["trajectory_msgs/msg/JointTrajectoryPoint"]
    duration = types.types["builtin_interfaces/msg/Duration"]
    points = [
        point(np.array([p]), np.array([10.0]), np.zeros(1), np.zeros(0), duration(0, ns))
        for p, ns in ((0.2, 0), (0.4, 20_000_000))
    ]
    kind = "trajectory_msgs/msg/JointTrajectory"
    message = types.types[kind](header=stamped_header(stamp_ns), joint_names=["base.rz"], points=points)
    return bytes(types.serialize_cdr(message, kind))


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plots") / "bag"
    streams = {stream.topic: stream for stream in STREAMS if stream.topic in BAGGED}
    with BagWriter(path, tuple(streams.values()), {"git": "0" * 40}) as writer:
        for k in range(20):
            stamp = ZERO_NS + k * PERIOD_NS
            status = {"mode": 1 + (k > 9), "limits_active": ["torque:base.rz"] * (k > 4), "solve_time": 1e-4}
            messages = {
                "joint_states": joint_state(stamp, 0.01 * k),
                "modal_state": modal_state(stamp),
                "controller_status": make(streams["controller_status"].type, stamp, **status),
                "motion_status": make(streams["motion_status"].type, stamp, state=1, distance=0.1 / (k + 1)),
            }
            if k == 2:
                messages["reference"] = reference(stamp)
            for topic, cdr in messages.items():
                writer.write(streams[topic].name, stamp, cdr)
    return path


def plot(*words: str) -> int:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return run(parser.parse_args(list(words)))


def test_the_page_has_the_panels_that_the_bag_allows_and_names_the_others(bag, tmp_path, capsys):
    assert plot(str(bag), "--html", str(tmp_path / "page.html")) == 0
    page, said = unescape((tmp_path / "page.html").read_text()), capsys.readouterr().out
    drawn = {"goals", "rungs", "joints", "modes", "sensors", "limits", "times"}
    for panel in PANELS:
        assert (panel.title in page) == (panel.name in drawn), panel.name
    assert page.count("<svg") == len(drawn) and "mpc" in page and "torque:base.rz" in page
    assert "tip            end_effector" in said and "energy         model" in said


def test_pictures_and_a_choice_of_topics(bag, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # without a file's name the page comes into the current folder
    assert plot(str(bag), "--topics", "motion_status", "--json", "page.json") == 0
    assert (tmp_path / "bag.html").is_file() and "goals" in (tmp_path / "page.json").read_text()
    assert plot(str(bag), "--png", str(tmp_path / "pictures"), "--topics", "motion_status") == 0
    (picture,) = (tmp_path / "pictures").iterdir()
    assert picture.name == "goals.png" and picture.read_bytes()[1:4] == b"PNG"
    capsys.readouterr()


def test_a_topic_that_is_not_there_and_a_folder_that_is_no_bag_end_with_two(bag, tmp_path, capsys):
    assert plot(str(bag), "--topics", "strain") == 2
    assert "no message on strain; it has /flexarm/controller_status" in capsys.readouterr().err
    assert plot(str(tmp_path)) == 2
    assert "has no metadata.yaml" in capsys.readouterr().err


def test_the_numbers_of_another_robot_are_drawn_topic_by_topic(tmp_path, capsys):
    panels = choose(BagSeries(check_bag(FOREIGN)), ())
    assert [panel.name for panel in panels] == ["imu", "joint_states"]
    assert plot(str(FOREIGN), "--topics", "/imu", "--html", str(tmp_path / "imu.html")) == 0
    page = (tmp_path / "imu.html").read_text()
    assert "Fields of /imu." in page and "angular_velocity.z" in page
    capsys.readouterr()


def test_a_signal_far_from_its_limit_keeps_its_scale_and_tells_its_share():
    with drawing() as plot:
        far, near, free = plot.subplots(3)
        for axes in (far, near, free):
            axes.plot([0.0, 1.0], [0.0, 30.0])
        assert reach(far, np.array([0.0, -30.0]), 1000.0) == "at most 3 % of the limit"
        assert reach(near, np.array([np.nan, 30.0]), 40.0) == "at most 75 % of the limit"
        assert reach(near, np.array([40.0]), 40.0) == "at the limit"
        assert reach(free, np.array([30.0]), np.inf) == reach(free, np.array([np.nan]), 40.0) == ""
        assert far.get_ylim()[1] < 40.0 and near.get_ylim()[0] < -40.0
        assert [len(axes.lines) for axes in (far, near, free)] == [1, 5, 1]


def test_limits_of_which_none_bound_are_told_in_words(bag):
    series = BagSeries(check_bag(bag))
    for msg in series.messages("controller_status"):
        msg.limits_active.clear()
    with drawing() as plot:
        draw_limits(plot, series)
    (axes,) = plot.axes
    assert [text.get_text() for text in axes.texts] == ["No limit bound, from 0 to 0.095 s."]
    assert not axes.axison


def test_the_reference_counts_from_when_it_was_sent(bag):
    series = BagSeries(check_bag(bag))
    wanted = asked(series, np.array([0.0, 0.01, 0.02, 0.5]), ("base.rz",))
    np.testing.assert_allclose(wanted[:, 0], [np.nan, 0.2, 0.3, 0.4])


def test_what_is_asked_of_an_axis_is_found_by_its_name_and_strange_axes_are_left_out(bag):
    series = BagSeries(check_bag(bag))
    wanted = asked(series, np.array([0.02]), ("gripper.jaw", "base.rz"))
    np.testing.assert_allclose(wanted, [[np.nan, 0.3]])
    assert asked(series, np.array([0.02]), ("elbow.rz",)).shape == (1, 0)


def test_points_without_velocities_are_drawn_as_the_spline_that_the_arm_follows(bag):
    series = BagSeries(check_bag(bag))
    msg = series.messages("reference")[0]
    t, theta = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.1, 0.2, 0.3])
    point, since = type(msg.points[0]), type(msg.points[0].time_from_start)
    nothing = np.zeros(0)
    msg.points = [
        point(np.array([p]), nothing, nothing, nothing, since(int(s), 0))
        for s, p in zip(t, theta, strict=True)
    ]
    drawn = references(series, ("base.rz",))[0][2]
    spline = CubicSpline(t, theta, bc_type="clamped")
    at = np.array([0.5, 1.0, 1.5, 2.7])
    np.testing.assert_allclose(drawn.sample(drawn.t[0] + at)[0][:, 0], spline(at), atol=1e-12)


def test_thinning_keeps_every_extreme_and_short_lines_whole():
    t = np.linspace(0.0, 1.0, 100_000)
    y = np.sin(40 * t)
    y[[777, 50_123]] = 9.0, -9.0
    thinned_t, thinned = thin(t, y)
    assert thinned_t.size <= 2 * STRETCHES and (np.diff(thinned_t) > 0).all()
    assert {9.0, -9.0} <= set(thinned)
    np.testing.assert_array_equal(thin(t[:100], y[:100])[1], y[:100])


@pytest.mark.parametrize("level", [5.0, -5.0])
def test_thinning_keeps_extremes_among_samples_that_are_no_numbers(level):
    """A gap counted as zero, so it was kept in the place of the dip beside it."""
    t = np.linspace(0.0, 1.0, 100_000)
    y = np.full(t.size, level)
    y[::7] = np.nan
    y[50_000:51_000] = np.nan
    y[777] = level / 2
    y[780] = np.inf
    thinned = thin(t, y)[1]
    assert level / 2 in thinned
    assert 5 < np.isnan(thinned).sum() < 10 and not np.isinf(thinned).any()


def test_spells_tell_from_when_to_when_a_value_held():
    assert spells(np.arange(5.0), ["a", "a", "b", "b", "a"]) == [
        (0.0, 2.0, "a"),
        (2.0, 2.0, "b"),
        (4.0, 1.0, "a"),
    ]
