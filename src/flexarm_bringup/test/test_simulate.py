"""``flexarm sim``: one short run end to end, and what counts as stable."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.loop_effort import Effort
from flexarm_bringup.page.report import Table
from flexarm_bringup.sim_run import study
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.report import build_page, gain_db, is_stable
from flexarm_bringup.sim_run.study import LegResult, SimResult, Trace, run_sim_job, sim_jobs
from flexarm_bringup.tasks.course import Leg
from flexarm_bringup.tasks.task_for import task_for
from flexarm_bringup.tip_vibration import Residual
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

TASK = """
format: flexarm-moves/1
manipulator: single_link
presets: [geared]
wait: 1.2 s
watch: {from: 100 ms, to: 1.1 s, below: 20 Hz, tolerance: 0.5 mm}
speed: 0.001
moves: {out: {by: {base.rz: 10 deg}, duration: 0.5 s, ramps: [0.3 s, 96 ms]}}
"""


def result(law: str, acceleration: float, growth: float = 0.1, **changes: Any) -> SimResult:
    leg = LegResult(Leg("out", 0.5, 1.0), Residual(acceleration, 1e-3, 0.1, growth), 1e-3, 0.5)
    trace = Trace(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 1)))
    effort = replace(Effort(4.0, 0, 0.0, unusable=0.0, guard=""), **changes)
    return SimResult("", "as described", law, (leg,), effort, trace)


def test_the_command_prints_and_writes_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "short.yaml").write_text(TASK, encoding="utf-8")
    files = ["--json", str(tmp_path / "sim.json"), "--html", str(tmp_path / "sim.html")]
    assert main(["sim", str(tmp_path / "short.yaml"), "--nominal", *files]) == 0
    out = capsys.readouterr().out
    assert "assumed" in out and "seed 1." in out
    page = json.loads((tmp_path / "sim.json").read_text(encoding="utf-8"))
    laws = {row[2]: row for row in page["tables"][0]["rows"]}
    assert laws["MPC"][3] < laws["PD"][3] / 4.0  # m/s^2: at least 12 dB
    assert page["rate_hz"] == 200.0 and page["real_time_over_dds"]
    assert "<svg" in (tmp_path / "sim.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_seed_of_the_command_is_that_of_the_rigs_noise(tmp_path: Path) -> None:
    path = tmp_path / "short.yaml"
    path.write_text(TASK, encoding="utf-8")
    assert main(["sim", str(path), "--nominal", "--seed", "5", "--json", str(tmp_path / "sim.json")]) == 0
    page = json.loads((tmp_path / "sim.json").read_text(encoding="utf-8"))
    task, left = task_for(str(path)), {}
    for seed in (1, 5):
        (job,) = sim_jobs(task, task.presets, [NOMINAL], seed)
        left[seed] = [result.acceleration for result in run_sim_job(job)]
    assert page["seed"] == 5
    assert [row[3] for row in page["tables"][0]["rows"]] == left[5]
    assert left[1] != left[5]


def test_a_late_camera_and_bodies_of_few_modes_are_told_below_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study, "describe_few_modes", lambda config: (f"few modes of {config.name}",))
    arm = find_manipulator("single_link").read_text(encoding="utf-8")
    assert "latency: 60 ms" in arm
    (tmp_path / "arm.yaml").write_text(arm.replace("latency: 60 ms", "latency: 400 ms"), encoding="utf-8")
    text = TASK.replace("manipulator: single_link", f"manipulator: {tmp_path / 'arm.yaml'}")
    (tmp_path / "short.yaml").write_text(text, encoding="utf-8")
    task = task_for(str(tmp_path / "short.yaml"))
    (job,) = sim_jobs(task, task.presets, [NOMINAL])
    results = run_sim_job(job)
    page = build_page(task, {"geared": load_config(tmp_path / "arm.yaml", "geared")}, results, (), 1)
    (table,) = [item for item in page.items if isinstance(item, Table)]
    assert any(note.startswith("rate 200 Hz: ") and "of mode 1" in note for note in table.notes)
    assert any(note.startswith("camera: latency 400 ms: none of its samples is used") for note in table.notes)
    assert "few modes of single_link" in table.notes


def test_a_law_that_the_gate_keeps_from_moving_is_told_below_the_table(tmp_path: Path) -> None:
    optimistic = "settings: {estimator: {modal_force: 1e-3, acceleration_noise: 0.03}}\n"
    text = TASK.replace("presets: [geared]", "presets: [light_hub]") + optimistic
    (tmp_path / "short.yaml").write_text(text, encoding="utf-8")
    task = task_for(str(tmp_path / "short.yaml"))
    (job,) = sim_jobs(task, task.presets, [NOMINAL])
    config = load_config(find_manipulator("single_link"), "light_hub")
    page = build_page(task, {"light_hub": config}, run_sim_job(job), (), 1)
    (table,) = [item for item in page.items if isinstance(item, Table)]
    assert any(note.startswith("over DDS MPC may not move: margins: mode 2 is unst") for note in table.notes)
    look = f"./flexarm margins {tmp_path / 'short.yaml'} --preset light_hub shows the margins of every mode"
    assert sum(note.startswith(look) for note in table.notes) == 1


def test_the_gate_is_asked_wherever_a_move_ends(tmp_path: Path) -> None:
    text = TASK.replace("by: {base.rz: 10 deg}", "by: {base.rz: 170 deg}").replace(
        "duration: 0.5", "duration: 2"
    )
    (tmp_path / "short.yaml").write_text(text, encoding="utf-8")
    (job,) = sim_jobs(task_for(str(tmp_path / "short.yaml")), ["geared"], [NOMINAL])
    (mpc,) = run_sim_job(replace(job, laws=("mpc",)))
    (refusal,) = mpc.refusals  # none at home
    assert "pose (2.967): limits bind: position:base.rz; it lies at" in refusal


def test_a_rate_that_cannot_follow_the_slowest_mode_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = find_manipulator("single_link").read_text(encoding="utf-8")
    assert "rate: 200 Hz" in arm
    (tmp_path / "arm.yaml").write_text(arm.replace("rate: 200 Hz", "rate: 9 Hz"), encoding="utf-8")
    text = TASK.replace("manipulator: single_link", f"manipulator: {tmp_path / 'arm.yaml'}")
    text = text.replace("below: 20 Hz", "below: 4 Hz")
    (tmp_path / "short.yaml").write_text(text, encoding="utf-8")
    for command in (
        ["sim", str(tmp_path / "short.yaml"), "--nominal"],
        ["model", str(tmp_path / "arm.yaml")],
    ):
        assert main(command) == 2
        assert "served.rate: 9 Hz: 1.7" in capsys.readouterr().err


def test_a_manipulator_without_moves_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sim", "no_such_arm"]) == 2
    assert "no_such_arm" in capsys.readouterr().err


def test_moves_that_ask_for_another_law_are_told_that_it_is_not_simulated() -> None:
    task = task_for("single_link")
    asking = replace(task, settings={**task.settings, "controller": {"law": "nmpc"}})
    config = load_config(find_manipulator("single_link"), "geared")
    pair = [replace(result(law, 1.0), preset="geared") for law in ("pd", "mpc")]
    said = [build_page(each, {"geared": config}, pair, (), 1).to_text() for each in (task, asking)]
    assert [
        "the moves ask for law 'nmpc'; what is called MPC here is law 'mpc'" in text for text in said
    ] == [False, True]


def test_the_gain_is_that_of_all_moves_together() -> None:
    pd, mpc = result("pd", 3.0), result("mpc", 0.1)
    both = replace(pd, legs=(*pd.legs, *result("pd", 4.0).legs))
    assert both.acceleration == pytest.approx(np.sqrt(12.5))
    assert gain_db({"pd": pd, "mpc": mpc}) == pytest.approx(20 * np.log10(30.0))


def test_a_run_is_unstable_when_stopped_or_when_its_vibration_grows_beyond_the_baselines() -> None:
    baseline = result("pd", 1.0)
    assert is_stable(result("mpc", 0.1, growth=3.0), baseline)  # noise may do that
    assert is_stable(result("mpc", 2.0, growth=0.5), baseline)
    assert not is_stable(result("mpc", 2.0, growth=1.5), baseline)
    assert not is_stable(result("mpc", 0.1, guard="no command for 50 ms"), baseline)
    assert not is_stable(result("mpc", 0.0, unusable=1.0), baseline)  # it stood still


@pytest.mark.parametrize(
    ("slow", "is_kept", "said"), [(1.0, False, "2.0 times"), (3.0, True, "by 3.00: 6.0")]
)
def test_speed_is_judged_at_that_of_the_class_of_machine(slow: float, is_kept: bool, said: str) -> None:
    task = replace(task_for("single_link"), presets=("",), speed=5.0)
    pair = [result("pd", 1.0), result("mpc", 0.1)]
    pair = [replace(each, effort=replace(each.effort, speed=2.0)) for each in pair]
    page = build_page(task, {"": load_config(find_manipulator("single_link"))}, pair, (), 1, slow)
    check = page.checks[-1]
    assert check.passed == is_kept
    assert said in check.found
    assert ("the speed is judged times that" in page.to_text()) == (slow > 1.0)


@pytest.mark.parametrize(
    ("told", "changes"),
    [
        ("the guard stopped it: no command for 50 ms", {"guard": "no command for 50 ms"}),
        ("no usable state or no plan in 100 % of the periods", {"unusable": 1.0}),
        (
            "at 1.945 s: lost: the motion is given up",
            {"given_up": "at 1.945 s: lost: the motion is given up"},
        ),
    ],
)
@pytest.mark.parametrize("law", ["pd", "mpc"])
def test_a_run_that_stood_still_is_told_and_is_no_gain(told: str, changes: dict[str, Any], law: str) -> None:
    task = replace(task_for("single_link"), presets=("",), gain_db=0.0, speed=1.0)
    pair = {"pd": result("pd", 1.0), "mpc": result("mpc", 0.5)}
    config = replace(load_config(find_manipulator("single_link")), fitted=())
    sound = build_page(task, {"": config}, list(pair.values()), (), 1)
    assert all(check.passed for check in sound.checks)
    assert all(sound.remarks.values())  # no heading above nothing
    pair[law] = result(law, 0.0, **changes)
    page = build_page(task, {"": config}, list(pair.values()), (), 1)
    (table,) = [item for item in page.items if isinstance(item, Table)]
    assert f"as described, {law.upper()}: {told}" in table.notes
    rows = {row[2]: row for row in table.rows}
    assert rows["MPC"][4] is None and rows[law.upper()][6] is None  # no gain, no settling
    assert rows[law.upper()][9] is False
    assert page.checks[0].found == f"none: {law.upper()} did not lead the arm"
    assert not page.checks[0].passed
