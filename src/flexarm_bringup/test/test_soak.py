"""The soak's chance, its arithmetic of memory, and its verdict."""

from __future__ import annotations

import os
import signal
import subprocess
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from flexarm_bringup.processes.graph import rig_graph
from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.standstill import Standstill, Witnesses
from flexarm_bringup.processes.supervisor import Ending
from flexarm_bringup.sim.sensor_fault_text import parse_faults
from flexarm_bringup.soak.command import check_length
from flexarm_bringup.soak.killed import Killed
from flexarm_bringup.soak.memory import PERIOD, Life, MemoryLog, resident_mb, shortest
from flexarm_bringup.soak.outcome import Outcome
from flexarm_bringup.soak.script import VICTIMS, Script, move, random_fault, random_goal
from flexarm_bringup.soak.worst import KEPT, Moment, WorstMoments
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError

SINGLE, LEGS = (load_config(find_manipulator(name)) for name in ("single_link", "planar_3rrr"))
WARM_UP = 60.0


def life(per_minute: float, seconds: float = 600.0, name: str = "rig") -> Life:
    """Return a process that takes 40 MB while it starts and then grows steadily."""
    t = np.arange(0.0, seconds)
    rss = 100.0 + 40.0 * np.minimum(t / 30.0, 1.0) + per_minute * t / 60.0
    return Life(name, 1, t.tolist(), rss.tolist())


def outcome(**changes: object) -> Outcome:
    good = Outcome(
        "arm",
        0.0,
        600.0,
        WARM_UP,
        [life(0.0)],
        120_000,
        LateCycles(),
        {"moves done": 3},
        {},
        {"moving": [1e-3]},
        {},
    )
    return replace(good, **changes)  # type: ignore[arg-type]


def grown(late: int) -> LateCycles:
    """Return a count that was told at 0 and at 1 s."""
    cycles = LateCycles()
    for now, count in ((0.0, 0), (1.0, late)):
        cycles.note(now, count)
    return cycles


def missed(found: Outcome) -> list[str]:
    return [check.name for check in found.checks() if not check.passed]


def test_growth_is_that_after_the_warm_up_and_the_slope_is_exact() -> None:
    leak = life(2.0)
    assert leak.slope(WARM_UP) == pytest.approx(2.0, rel=1e-6)
    assert leak.growth(WARM_UP) == pytest.approx(2.0 * (600.0 - WARM_UP - 10.0) / 60.0, rel=1e-2)
    assert life(0.0).growth(WARM_UP) == pytest.approx(0.0, abs=1e-9)


def test_a_life_too_short_to_tell_is_not_judged() -> None:
    assert life(9.0, 70.0).growth(WARM_UP) is None and life(9.0, 70.0).slope(WARM_UP) is None
    assert missed(outcome(lives=[life(0.0), life(99.0, 70.0)])) == []
    assert missed(outcome(lives=[life(0.0, 70.0)])) == ["memory of rig grows"]  # nobody knows


def test_eleven_megabytes_are_a_leak_and_nine_are_none() -> None:
    per_minute = 60.0 / (600.0 - WARM_UP - 10.0)
    assert missed(outcome(lives=[life(9.0 * per_minute)])) == []
    assert missed(outcome(lives=[life(11.0 * per_minute)])) == ["memory of rig grows"]


@pytest.mark.parametrize(("per_minute", "found"), [(0.3, []), (0.7, ["memory of rig grows"])])
def test_a_leak_that_kills_cut_short_is_found(per_minute: float, found: list[str]) -> None:
    """0.7 MB a minute are 20 MB in half an hour; no life of a process that is killed saw ten of them."""
    lives = [life(per_minute, seconds) for seconds in (300.0, 700.0, 500.0, 300.0)]
    assert missed(outcome(lives=lives, seconds=1800.0)) == found


def test_one_late_guard_cycle_no_move_and_an_early_end_are_missed_bounds() -> None:
    assert missed(outcome(late=grown(1))) == missed(outcome(cycles=0)) == ["guard cycles that were late"]
    assert missed(outcome(counts={})) == ["moves done"]
    assert missed(outcome(failure="rig ended with -9")) == ["it came to its end"]


def test_the_page_tells_every_life_and_draws_it() -> None:
    page = outcome(lives=[life(0.0), life(0.0, 90.0)]).page()
    assert page.passed and len(page.data["lives"]) == 2
    assert "<svg" in page.to_html() and "too short to tell" in page.to_text()


def test_the_memory_of_a_process_that_is_there_is_known_and_of_no_other() -> None:
    held = bytearray(30_000_000)
    log = MemoryLog()
    log.look(0.0, {"we": os.getpid(), "nobody": 2**22 + 1})
    assert [entry.name for entry in log.lives] == ["we"]
    assert 30.0 < log.lives[0].rss[0] < 4000.0 and len(held)
    assert resident_mb(2**22 + 1) is None


def test_a_process_started_again_begins_a_new_life() -> None:
    log = MemoryLog()
    log.look(0.0, {"we": os.getpid()})
    log.look(1.0, {"we": os.getppid()})
    assert [len(entry.t) for entry in log.lives] == [1, 1]


@pytest.mark.parametrize("config", [SINGLE, LEGS], ids=lambda config: config.name)
def test_goals_lie_where_the_arm_may_go_and_moves_begin_and_end_at_rest(config: object) -> None:
    rng = np.random.default_rng(4)
    at = np.array(config.home)
    axes = list(config.actuated.values())
    for _ in range(20):
        goal = random_goal(rng, config)
        reference = move(rng, at, goal, config)
        assert all(axis.lower <= value <= axis.upper for axis, value in zip(axes, goal, strict=True))
        assert reference.theta[0] == pytest.approx(at) and reference.theta[-1] == pytest.approx(goal)
        assert abs(reference.theta_dot[[0, -1]]).max() < 1e-9
        assert (
            abs(reference.theta_dot).max(axis=0) <= [0.5 * axis.velocity * (1 + 1e-9) for axis in axes]
        ).all()
        at = goal


def test_every_fault_that_is_drawn_is_one_that_the_rig_understands() -> None:
    rng, kinds = np.random.default_rng(7), Counter()
    for _ in range(300):
        faults = parse_faults(random_fault(rng, SINGLE.sensors), SINGLE.sensors)
        assert len(faults) == 1
        kinds.update(fault.kind for fault in faults.values())
    assert len(kinds) == 9 and min(kinds.values()) > 10  # of 300 in 9 kinds


def test_events_come_at_their_mean_and_never_when_they_are_switched_off() -> None:
    script, times = Script(1, 10.0, 0.0), []
    for t in np.arange(0.0, 10_000.0, 0.25):
        times += [t for event in script.due(t) if event == "fault"]
    gaps = np.diff(times)
    assert gaps.mean() == pytest.approx(10.0, rel=0.1)  # three sigma of a thousand draws with sigma 5
    assert gaps.min() >= 5.0 - 0.3
    assert {script.victim() for _ in range(50)} == set(VICTIMS)
    assert "kill" not in script.due(1e9)


def test_the_same_seed_does_the_same() -> None:
    a, b = (Script(3, 5.0, 20.0) for _ in range(2))
    assert [a.due(t) for t in range(200)] == [b.due(t) for t in range(200)]
    assert a.victim() == b.victim() and random_fault(a.rng, SINGLE.sensors) == random_fault(
        b.rng, SINGLE.sensors
    )


def test_the_worst_moments_are_kept_each_but_once_and_with_what_was_going_on() -> None:
    worst = WorstMoments()
    for k in range(100_000):
        t = 0.02 * k
        peak = int(t) % 100 == 7  # one second in a hundred, 20 of them
        error = 1e-3 * (int(t) // 100 + 1) * (1.0 + 0.01 * (k % 50)) if peak else 1e-5
        worst.note(Moment(t, error, "moving", True, "ok", f"fault {int(t) // 100}"))
    kept = worst.worst
    assert len(kept) == KEPT and [each.fault for each in kept] == [f"fault {19 - k}" for k in range(KEPT)]
    assert all(each.error == pytest.approx(1.49e-3 * (20 - k)) for k, each in enumerate(kept))
    worst.note(Moment(2000.5, 1.0, "stopped", False, "lost", "fault 20"))
    assert worst.worst[:-1] == kept and not worst.worst[-1].is_usable


def test_late_cycles_of_a_guard_that_starts_again_add_to_those_before() -> None:
    cycles = LateCycles()
    for now, (late, ticks) in enumerate(
        [(0, 10), (3, 200), (10, 400), (50, 600), (0, 5), (0, 100), (2, 300)]
    ):
        cycles.note(float(now), late, ticks)
    assert cycles.total == 52 and cycles.cycles == 590 + 295
    assert cycles.during([Standstill(5.5, 5.6)]) == 2  # of the new guard
    assert cycles.during([Standstill(3.5, 3.6)]) == 0  # it came back without any
    cycles.begin()
    assert cycles.total == cycles.cycles == 0


def test_a_new_guard_with_more_late_cycles_than_the_old_one_is_known_by_its_ticks() -> None:
    cycles = LateCycles()
    for now, (late, ticks) in enumerate([(0, 100), (1, 200), (4, 20), (6, 40)]):
        cycles.note(float(now), late, ticks)
    assert cycles.total == 3


def test_who_is_killed_on_purpose_has_not_ended_by_itself_and_everybody_else_has() -> None:
    rows, killed = {row.name: row for row in rig_graph("single_link", "geared")}, Killed()
    child = subprocess.Popen(["sleep", "60"])
    killed.kill("estimator", child.pid)
    assert child.wait() == -signal.SIGKILL
    killed.note(Ending(rows["estimator"], -signal.SIGKILL, "", True))
    assert not killed.own_ends
    for name, code in (("estimator", -9), ("guard", -9), ("guard", -9), ("model", -11)):
        killed.note(Ending(rows[name], code, "", True))
    assert killed.own_ends == {"estimator with -9": 1, "guard with -9": 2, "model with -11": 1}


def test_a_process_that_crashes_before_it_could_be_killed_has_ended_by_itself() -> None:
    killed, child = Killed(), subprocess.Popen(["sleep", "60"])
    killed.kill("model", child.pid)
    child.wait()
    (row,) = (row for row in rig_graph("single_link", "geared") if row.name == "model")
    killed.note(Ending(row, -signal.SIGSEGV, "", True))
    assert killed.own_ends == {"model with -11": 1}


def test_an_end_that_nobody_meant_is_a_missed_bound_that_names_process_and_exit_code() -> None:
    found = outcome(own_ends={"guard with -9": 2, "estimator with -11": 1})
    assert missed(found) == ["ended by itself"]
    (told,) = (check.found for check in found.checks() if check.name == "ended by itself")
    assert told == "guard with -9, 2 times; estimator with -11"


def test_the_page_tells_standstills_of_the_soak_and_not_of_the_start_of_its_nodes() -> None:
    witnesses = Witnesses()
    witnesses.standstills = [Standstill(90.0, 90.5), Standstill(200.0, 200.003), Standstill(701.0, 701.1)]
    tables = {table.title: table for table in outcome(began=100.0, witnesses=witnesses).page().items[:-1]}
    told = dict(tables["the machine itself"].rows)
    assert told["standstills of a core of more than 2 ms"] == 1
    assert told["longest standstill of a core [ms]"] == pytest.approx(3.0)


def test_a_soak_in_which_no_memory_can_be_judged_is_refused_with_the_length_that_can() -> None:
    with pytest.raises(ConfigError, match=r"--minutes 1: .*--warm-up 60, 1\.37 at least"):
        check_length(1.0, WARM_UP)
    check_length(1.37, WARM_UP)


def test_the_shortest_soak_that_is_not_refused_tells_the_growth_of_a_process_that_lives_throughout() -> None:
    looks = shortest(WARM_UP) - 2.0 * PERIOD  # both ends late by a whole period
    assert life(0.0, looks + 1.0).growth(WARM_UP) is not None
