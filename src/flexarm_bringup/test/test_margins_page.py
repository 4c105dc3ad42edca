"""The page of margins: what its columns hold, what its figures show, and poses that cannot be judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn import box_of, drawn_by, overlapping
from small_arm import small_arm

from flexarm_bringup.cli import main
from flexarm_bringup.margins import drawing
from flexarm_bringup.margins.command import with_settings
from flexarm_bringup.margins.page import build_page
from flexarm_bringup.margins.study import PoseResult, Study
from flexarm_bringup.page.report import Table
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.margins.case import ALL_TORQUES, Case, Margin
from flexarm_controller.margins.gain_margin import GainMargin
from flexarm_controller.margins.short_law import ShortCase
from flexarm_controller.settings import MarginConfig
from flexarm_model.reading.manipulator_file import find_manipulator

TWO_LINK = Path(__file__).parents[3] / "docs" / "two_link.yaml"
CONFIG, DT = MarginConfig(), 0.005
MODES = 30  # as many as the six-axis arm has


def case(decibels: float, error: float = 0.0, radius: float = 0.9) -> Case:
    """Return a case all of whose modes have a gain margin, and one eigenvalue of such a size."""
    gain, names = GainMargin(10.0 ** (decibels / 20.0), 0.0), [f"mode_{k + 1}" for k in range(MODES)]
    margins = tuple(Margin(name, 1.0 + k, gain, 4 * DT, True) for k, name in enumerate(names))
    torques = Margin(ALL_TORQUES, 0.0, gain, 4 * DT, True)
    poles = np.array([radius * np.exp(1.0j), 0.5 + 0.1j])
    grows = radius >= 1.0
    return Case(
        (0.0,), error, -1.0, "mode_1", 1.0, () if grows else (torques, *margins), poles, ("axes", "axes")
    )


def study(**poses: tuple[Case, ...]) -> Study:
    results = tuple(PoseResult(label, (1.0,), cases) for label, cases in poses.items())
    return Study(task_for("single_link"), "geared", DT, ("mode_1",), (), results)


def first_table(of: Study) -> Table:
    table = build_page(of, CONFIG, []).items[0]
    assert isinstance(table, Table)
    return table


def cell(table: Table, path: str, column: str) -> object:
    row = next(row for row in table.rows if row[0] == path)
    return row[[item.title.replace("\n", " ") for item in table.columns].index(column)]


def test_as_described_is_the_smallest_over_poses_and_its_pose_is_named() -> None:
    table = first_table(study(home=(case(13.0), case(9.0, 0.1)), stretched=(case(5.2), case(6.0, 0.1))))
    assert cell(table, "mode 1", "as described gain [dB]") == pytest.approx(5.2)
    assert table.texts()[1][4] == "stretched"
    assert cell(table, "mode 1", "worst gain [dB]") == pytest.approx(5.2)


def firm_table(**poses: ShortCase) -> Table:
    kept = (case(13.0),)
    results = tuple(PoseResult(label, (1.0,), kept, (firm,)) for label, firm in poses.items())
    config = replace(CONFIG, frequency_off=0.0)
    items = build_page(replace(study(), poses=results), config, []).items
    (table,) = [item for item in items if isinstance(item, Table) and item.title.startswith("Firm law")]
    return table


def test_the_kicked_mode_that_is_worst_is_named_with_its_pose() -> None:
    calm = ShortCase((0.0,), 0.0, 0.6, 1.5, "mode_1", 3.0, {"mode_1": 1.1, "mode_2": 1.2})
    table = firm_table(home=calm, mid=replace(calm, growth=0.5, kicked={"mode_1": 1.9, "mode_2": 1.0}))
    assert table.rows[0][1:] == [1.5, 3.0, "mode 1", "home", 1.9, "mode 1", "mid"]


def test_an_arm_without_an_elastic_body_has_a_firm_law_and_nothing_to_kick() -> None:
    """The largest of no factors was asked for: a traceback in place of the page."""
    table = firm_table(home=ShortCase((0.0,), 0.0, 0.6, 0.8, "axes", 2.0, {}))
    assert table.rows[0][1:] == [0.8, 2.0, "axes", "home", None, "", ""]


@pytest.mark.parametrize(
    ("preset", "latency", "told"),
    [("geared", 0.0, "2 periods of 5 ms (delay_periods 2, latency 0 ms)"),
     ("light_hub", 0.0, "1 period of 5 ms (delay_periods 1, latency 0 ms)"),
     ("light_hub", 0.003, "2 periods of 5 ms (delay_periods 1, latency 3 ms)")],
)  # fmt: skip
def test_the_page_tells_the_delay_that_was_closed(preset: str, latency: float, told: str) -> None:
    task = with_settings(task_for("single_link"), [f"mpc.latency={latency}"])
    closed = replace(study(home=(case(13.0),)), task=task.under(preset), preset=preset)
    said = build_page(closed, CONFIG, []).to_text()
    assert f"delay from a state to its torque: {told}; limits do not bind" in said


@pytest.mark.parametrize(
    ("bodies", "told"), [((), ""), (("casting", "blade"), " (none more: casting, blade)")]
)
def test_the_page_names_the_bodies_that_have_no_more_modes(bodies: tuple[str, ...], told: str) -> None:
    """Bodies whose modes a frequency or a file gives had none more, though every body was said to have."""
    said = build_page(replace(study(home=(case(13.0),)), no_more=bodies), CONFIG, []).to_text()
    assert f"3 more modes per body, as far as it has them{told}, up to" in said


def test_a_loop_that_is_stable_only_with_other_frequencies_has_no_margin_as_described() -> None:
    table = first_table(study(home=(case(0.0, radius=1.1), case(9.0, 0.1))))
    assert cell(table, "mode 1", "as described gain [dB]") is None
    assert cell(table, "mode 1", "worst gain [dB]") == pytest.approx(9.0)


def test_a_pose_at_the_end_of_a_range_is_told_by_name_and_the_others_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = tmp_path / "at_the_end.yaml"
    text = find_manipulator("single_link").read_text(encoding="utf8")
    assert "home: [0 deg], " in text and "upper: 170 deg" in text
    arm.write_text(
        text.replace("home: [0 deg], ", "home: [0 deg], poses: {stop: [170 deg]}, "), encoding="utf8"
    )
    assert main(["margins", str(arm), "--preset", "geared", "--along", "0"]) == 1
    said = capsys.readouterr().out
    (stop,) = [line for line in said.splitlines() if "pose stop" in line]
    assert stop.strip().startswith("MISSED") and "position:base.rz" in stop and "end of that range" in stop
    (home,) = [line for line in said.splitlines() if "pose home" in line and "dB" in line]
    assert home.strip().startswith("ok") and home.rstrip().endswith("kept")
    assert "1 pose (1 more could not be judged)" in said


def test_what_grows_is_marked_and_every_colour_is_in_the_legend(monkeypatch: pytest.MonkeyPatch) -> None:
    of = study(home=(case(9.0), case(0.0, 0.1, radius=1.05)))
    poles, _ = drawn_by(monkeypatch, drawing, lambda: drawing.draw(of, CONFIG))
    (axes,) = poles.axes
    shown = {group.get_label(): group for group in axes.collections}
    assert np.abs(shown[drawing.GROWS].get_offsets() @ [1.0, 1.0j]).min() > 1.0
    assert np.abs(shown[drawing.OTHERS].get_offsets() @ [1.0, 1.0j]).max() < 1.0
    (legend,) = poles.legends
    assert [text.get_text() for text in legend.get_texts()] == list(shown)
    assert not legend.get_window_extent().overlaps(axes.get_window_extent())


def test_the_labels_of_the_bars_can_be_read_and_cut_bars_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    short = study(home=(case(12.0), case(3.0, -0.1)), stretched=(case(70.0),))
    long = study(home=(case(70.0, -0.1),))
    for each, said in ((short, "-10 %"), (long, "\u2192")):
        _, bars = drawn_by(monkeypatch, drawing, lambda each=each: drawing.draw(each, CONFIG))
        for axes, text in zip(bars.axes, (said, "\u2192"), strict=True):  # no delay makes these unstable
            labels = list(axes.texts)
            assert [label.get_text() for label in labels] == [text] * (MODES + 1)
            assert overlapping(labels) == []
            top = axes.get_window_extent().y1
            assert all(box_of(label).y1 <= top for label in labels)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (  # it lies along x with 0.31 kg and turns about y
            {
                "joints__base__axes": {"ry": {"actuated": True, "effort": "0.5 N m", "velocity": "1 rad/s"}},
                "sensors__encoder__axis": "base.ry",
            },
            "axis base.ry: its motor is too weak for pose (0): holding the arm at rest there "
            "takes 0.765 N m, its effort is 0.5 N m",
        ),
        ({"sensors__encoder": None}, "; no encoder reads base.rz: mount one, cameras come too late"),
    ],
)
def test_a_weak_motor_and_an_axis_nobody_reads_are_told_as_such(
    changes: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = small_arm(tmp_path, gravity=["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"], **changes)
    assert main(["margins", str(arm), "--along", "0"]) == 1
    out = capsys.readouterr().out
    assert said in out
    assert "Margins per path" not in out and "up to 0 Hz" not in out  # no table of nothing


def test_axes_that_nobody_reads_and_that_go_nowhere_are_said_to_drift(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = TWO_LINK.read_text(encoding="utf8").splitlines(keepends=True)
    arm = tmp_path / "blind.yaml"
    arm.write_text("".join(line for line in lines if "elbow_encoder" not in line), encoding="utf8")
    assert main(["margins", str(arm), "--along", "0"]) == 1
    (home,) = [
        line for line in capsys.readouterr().out.splitlines() if "pose home" in line and "MISSED" in line
    ]
    assert "the axes drift: no sensor that speaks in every period tells where they stand" in home
    assert home.endswith("; no encoder reads elbow.rz: mount one, cameras come too late")
