"""A motion over which the model changes: nodes in lockstep, one process and a replay do the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup.bags.bag_reader import check_bag, decode
from flexarm_bringup.demo_run.sessions import free_domains
from flexarm_bringup.demo_run.task_session import run_task_session, torque_difference
from flexarm_bringup.replaying.compare import compare_bags
from flexarm_bringup.replaying.replay_bag import NEEDED, OUTPUTS, replay
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.study import run_sim_job, sim_jobs
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_bringup.topics import NAMESPACE

pytestmark = [pytest.mark.ros, pytest.mark.slow]

SAGS = "variable_stiffness"  # differently in every pose
STARTS_ELSEWHERE = "planar_3rrr"  # than at the home of its description


@pytest.mark.parametrize("name", [SAGS, STARTS_ELSEWHERE])
def test_models_change_in_the_same_tick_over_dds_in_one_process_and_in_a_replay(
    name: str, tmp_path: Path
) -> None:
    task = load_task(find_task(name))
    task = replace(task, moves=dict(list(task.moves.items())[:1]), wait=task.watch.end + 0.1)
    job = replace(sim_jobs(task, task.presets[:1], [NOMINAL])[0], laws=("mpc",))
    library = run_sim_job(job)[0]
    assert library.effort.served > 5

    nodes = run_task_session(job, library, True, tmp_path / "run", next(free_domains()), lambda text: None)
    assert torque_difference(nodes, library) < 1e-7  # of a limit; camera poses are quaternions
    assert nodes.guard["ticks_without_command"] == nodes.guard["refused"] == 0

    recorded = check_bag(nodes.session.bag, NEEDED)
    commands = [decode(record) for record in recorded.records if record.name == f"{NAMESPACE}/joint_commands"]
    used = list(dict.fromkeys(msg.model_id for msg in commands))
    served = [decode(record).model_id for record in recorded.records if record.name == f"{NAMESPACE}/model"]
    assert used == served[: len(used)]
    assert len(used) >= library.effort.served + 1

    replayed = replay(recorded, tmp_path / "replay")
    differing = [d for d in compare_bags(recorded, replayed, OUTPUTS).divergences if d.field]
    assert not differing, differing[:3]  # a message in flight at the end may be missing, none may differ
