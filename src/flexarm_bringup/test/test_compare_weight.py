"""``flexarm compare`` on arms with weight, with gauges, and on such as cannot be used at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.compare_laws.checks import all_checks
from flexarm_bringup.compare_laws.comparison import Comparison
from flexarm_bringup.compare_laws.judged import CompareResult, LegFigures
from flexarm_bringup.compare_laws.legs import ComparedLeg, compared_legs
from flexarm_bringup.compare_laws.open_loop_motions import LegMotions
from flexarm_bringup.compare_laws.runs import with_effort
from flexarm_bringup.compare_laws.schemes import MPC, PD, SERVO, WORST, Case
from flexarm_bringup.compare_laws.sound_arm import heaviest, sound_arm
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = Path(__file__).resolve().parents[3] / "docs" / "two_link.yaml"
UPRIGHT = {
    "gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]": "gravity: [0 m/s^2, -9.81 m/s^2, 0 m/s^2]",
    "home: [20 deg, 60 deg]": "home: [-60 deg, 40 deg]",
    "poses: {stretched: [0 deg, 10 deg]}": "poses: {up: [60 deg, 40 deg]}",
}


def upright(folder: Path, profile: str, compare: str = "{}", effort: str = "20 N m") -> str:
    """Write the arm of the manual standing upright with a move of 120 deg against its weight."""
    text = ARM.read_text(encoding="utf-8")
    for old, new in {**UPRIGHT, "effort: 20 N m": f"effort: {effort}"}.items():
        assert old in text, old
        text = text.replace(old, new)
    (folder / "upright.yaml").write_text(text, encoding="utf-8")
    path = folder / "moves.yaml"
    path.write_text(
        f"format: flexarm-moves/1\nmanipulator: {folder / 'upright.yaml'}\nwait: 2.5 s\n"
        "watch: {from: 100 ms, to: 2.1 s, below: 50 Hz, tolerance: 0.5 mm}\n"
        f"moves: {{there: {{to: up, {profile}}}}}\ncompare: {compare}\n",
        encoding="utf-8",
    )
    return str(path)


SLOW = "duration: 3 s, ramps: [1 s, 1 s]"


@pytest.fixture(scope="module")
def raised(tmp_path_factory: pytest.TempPathFactory) -> tuple[Task, ReducedTree, ComparedLeg]:
    task = task_for(upright(tmp_path_factory.mktemp("up"), SLOW, "{scarce_gain_db: 3}"))
    tree, home = sound_arm(task, "")
    return task, tree, compared_legs(tree, task, home)[0]


def test_torque_is_what_gravity_asks_along_the_whole_way(
    raised: tuple[Task, ReducedTree, ComparedLeg],
) -> None:
    """It was that of the goal, where this arm is nearly upright: half of what holding it half-way takes."""
    _, tree, leg = raised

    def weight(theta: np.ndarray) -> np.ndarray:
        """Return the torque that holds the arm, by the equations themselves (n_theta,)."""
        q, _ = find_equilibrium(tree, theta)
        return tree.linearisation(q)[3][tree.actuated]

    shares = np.linspace(0.0, 1.0, 121)
    most = np.max([abs(weight(leg.start + s * (leg.goal - leg.start))) for s in shares], axis=0)
    np.testing.assert_allclose(leg.hold(leg.given), most, rtol=0.01)
    assert most[0] > 1.5 * abs(weight(leg.goal))[0]
    assert (leg.peak(leg.given) >= 0.99 * most).all()
    weak = replace(leg, limits=replace(leg.limits, effort=np.array([0.95 * most[0], 6.0])))
    assert weak.excess(weak.given) == "torque"


def test_scarce_torque_still_holds_the_arm_and_the_guard_takes_it(
    raised: tuple[Task, ReducedTree, ComparedLeg],
) -> None:
    """Half the peak was less than the weight: every scarce row was refused, of an effort nobody wrote."""
    task, tree, leg = raised
    case = Case(task, (leg,), {"there": LegMotions({WORST: leg.given}, {}, None)}, heaviest(tree))
    scarce, hold, peak = case.scarce_effort, leg.hold(leg.given), leg.peak(leg.given)
    assert (scarce > hold).all() and (scarce < leg.limits.effort).all()
    np.testing.assert_allclose(
        scarce, np.maximum(hold + 0.5 * (peak - hold), 1.1 * np.maximum(hold, case.weight))
    )
    fast = replace(leg, given=leg.given.stretched(0.6))
    scarce = replace(case, legs=(fast,)).scarce_effort
    np.testing.assert_allclose(scarce, (fast.hold(fast.given) + fast.peak(fast.given)) / 2)
    scarce = case.scarce_effort
    weak = ReducedTree(with_effort(tree.config, scarce))
    assert guard_limits(weak.config, weak, GuardSettings()).effort == pytest.approx(scarce)


def test_a_motion_that_strains_a_gauge_beyond_its_limit_is_not_within_the_limits(
    raised: tuple[Task, ReducedTree, ComparedLeg],
) -> None:
    _, _, leg = raised
    assert 0.2 < leg.along.strain_share(leg.given) < 0.4  # the weight alone bends it by 0.29 of the limit
    assert leg.excess(leg.given) == ""
    fast = leg.given.stretched(0.45)  # of ramps of 0.15 s
    roomy = replace(leg.limits, effort=np.full(2, 1e3), velocity=np.full(2, 1e3))
    assert replace(leg, limits=roomy).excess(fast) == "strain"


def test_an_arm_that_cannot_hold_its_weight_is_refused_before_anything_is_planned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It ended with 1 after 40 s, and every row said so."""
    assert main(["compare", upright(tmp_path, SLOW, effort="3 N m"), "--quick"]) == 2
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("flexarm")]
    assert len(told) == 1 and "effort 3: the motor cannot hold the weight" in told[0]


def test_a_motion_that_no_arm_has_is_refused_with_file_and_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = upright(tmp_path, SLOW, "{shaped: ZVDD}")
    assert main(["compare", path, "--quick"]) == 2
    told = capsys.readouterr().err
    assert f"{path}: compare.shaped: 'ZVDD': expected one of worst profile" in told and "ZVD;" in told


@pytest.mark.parametrize(
    ("ramps", "told"), [("[2 s, 2 s]", "at most the duration, 3 s"), ("[0 s, 1 s]", "both must be > 0 s")]
)
def test_ramps_that_do_not_fit_are_refused_in_the_words_of_the_file(
    tmp_path: Path, ramps: str, told: str
) -> None:
    with pytest.raises(ConfigError, match=rf"moves\.there\.ramps: .*{told}"):
        task_for(upright(tmp_path, f"duration: 3 s, ramps: {ramps}"))


def row(law: str, motion: str, residual: float, error: float) -> CompareResult:
    legs = (LegFigures(residual, 0.1, 1.1, 0.0, 0.5, 1e-4),)
    return CompareResult("", error, motion, law, False, legs, "", np.zeros(1), np.zeros(1))


def test_a_bound_that_noise_decides_says_so() -> None:
    rows = [row(SERVO, WORST, 2.0, 0.0)]
    for error, left in ((-0.1, 0.055), (0.1, 0.5)):
        rows += [row(MPC, WORST, left, error), row(PD, "ZVD", 0.05, error)]
    task = replace(task_for("single_link"), compare=Comparison())
    first, second, both = all_checks(task, rows, {-0.1: 0.05, 0.1: 0.05})
    assert "of MPC's 0.0550 noise alone leaves 0.0500, see --seed" in first.found
    assert "noise" not in second.found and "noise" not in both.found
