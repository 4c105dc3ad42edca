"""Arms without a moves file: the tour of "flexarm sim" with settings that nobody chose for them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup.sim_run.study import NOMINAL, run_sim_job, sim_jobs
from flexarm_bringup.tasks.task_for import SETTINGS, task_for

ROOT = Path(__file__).parents[3]
FLAT, UPRIGHT = ROOT / "docs" / "two_link.yaml", Path(__file__).parent / "arms" / "crane.yaml"
PAGE = ROOT / "docs" / "your_own_arm.md"
SOFT = "stiffness -20 %"


@pytest.mark.thorough
@pytest.mark.parametrize(("path", "condition"), [(FLAT, SOFT), (UPRIGHT, NOMINAL), (UPRIGHT, SOFT)])
def test_an_arm_that_is_softer_than_described_tours_its_poses_and_rests_where_it_ends(
    path: Path, condition: str
) -> None:
    (job,) = sim_jobs(task_for(str(path)), [""], [condition])
    (mpc,) = run_sim_job(replace(job, laws=("mpc",)))
    assert mpc.effort.guard == ""
    assert mpc.effort.unusable < 0.01  # state lost: without states for where it rests 68 % of the periods
    assert max(leg.residual.distance for leg in mpc.legs) < 2e-3  # m, RMS; it swung by half a metre


def test_the_moves_file_of_the_page_has_the_settings_of_the_tour(tmp_path: Path) -> None:
    blocks = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (text,) = [block for block in blocks if "flexarm-moves/1" in block]
    path = tmp_path / "moves.yaml"
    path.write_text(text.replace("two_link.yaml", str(FLAT)), encoding="utf-8")
    told = {name: values for name, values in task_for(str(path)).settings.items() if values}
    assert told == {
        **SETTINGS,
        "schedule": {"angle": SETTINGS["schedule"]["angle"]},
    }
