"""The fault matrix at library level: every row on every machine, by the functions that print the table."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from missed_bounds import MISSED, judge

from flexarm_bringup.cli import main
from flexarm_bringup.fault_drill.drill import (
    CONTROLLER_ROWS,
    ESTIMATOR_ROWS,
    FAMILIES,
    MACHINES,
    RowResult,
    play_row,
    stand_of,
)
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.payload import take_over
from flexarm_bringup.fault_drill.sample_rows import ROWS as SAMPLE_ROWS
from flexarm_bringup.fault_drill.stand import Skipped
from flexarm_bringup.faults import build_page, chosen_rows
from flexarm_bringup.sim.plant import Plant
from flexarm_model.tree.sensors import output_names

STOPPING = (45, 53, 54)  # controller rows that the other arms play, too
OTHER_ARMS = (31, 32, 33)  # estimator rows that the other arms play, too
OTHERS = ("spatial_3tpt", "serial_6r", "variable_stiffness")


SLOW = {"single_link": (35,), "planar_3rrr": (31, 32, 33, 35, 53)}  # two fifths of the time of all
LONG = {"single_link": (), "planar_3rrr": (19, 28)}  # messages of every kind: a sixth of the rest


def speed_of(machine: str, row: int) -> tuple[pytest.MarkDecorator, ...]:
    """Return the mark of a row by how long it takes."""
    if row in SLOW[machine]:
        return (pytest.mark.slow,)
    return (pytest.mark.long,) if row in LONG[machine] else ()


def rows_and_machines() -> list[object]:
    return [
        pytest.param(family, number, machine, id=f"row {number} {machine}", marks=speed_of(machine, number))
        for machine in MACHINES
        for family, rows in (("estimator", ESTIMATOR_ROWS), ("controller", CONTROLLER_ROWS))
        for number in rows
    ] + [
        pytest.param(
            family,
            number,
            machine,
            id=f"row {number} {machine}",
            marks=pytest.mark.slow,
        )
        for family, machines, numbers in (
            ("controller", OTHERS, STOPPING),
            ("controller", ("variable_stiffness",), (35,)),
            ("controller", ("serial_6r",), (35, 36, 39)),
            ("estimator", OTHERS, OTHER_ARMS),
        )
        for machine in machines
        for number in numbers
    ]


@pytest.mark.parametrize(("family", "number", "machine"), rows_and_machines())
def test_every_bound_of_the_row_is_kept(family: str, number: int, machine: str) -> None:
    result = play_row(machine, family, number)
    if result.skipped:
        pytest.skip(result.skipped)
    assert result.findings
    judge(machine, number, result.findings)


def test_what_is_missed_beside_what_is_listed_and_what_is_listed_and_kept_fail() -> None:
    """A row with a bound that no filter keeps hid another one that was missed."""
    of_row_17 = [Finding(what, 9.0, 8.0) for what in MISSED["single_link", 17].findings]
    with pytest.raises(pytest.xfail.Exception, match="least error of any filter"):
        judge("single_link", 17, [*of_row_17, Finding("accelerometer", 4.0, 8.0)])
    with pytest.raises(AssertionError, match="accelerometer: 12 , wanted ≤ 8"):
        judge("single_link", 17, [*of_row_17, Finding("accelerometer", 12.0, 8.0)])
    with pytest.raises(AssertionError, match="listed: .'encoder"):
        judge("single_link", 17, [Finding("accelerometer", 4.0, 8.0)])
    judge("planar_3rrr", 17, [Finding("accelerometer", 4.0, 8.0)])


def test_the_matrix_has_rows_1_to_33() -> None:
    assert list(ESTIMATOR_ROWS) == list(range(1, 34))


def test_the_matrix_of_the_controller_has_its_rows() -> None:
    assert list(CONTROLLER_ROWS) == [*range(34, 43), 45, 53, 54]
    assert chosen_rows("30-36", ["controller"]) == {"controller": (34, 35, 36)}
    assert chosen_rows("33-34") == {"estimator": (33,), "controller": (34,)}


@pytest.mark.parametrize(
    ("text", "rows"), [("1-3", (1, 2, 3)), ("20, 5", (5, 20)), (None, tuple(range(1, 34)))]
)
def test_rows_are_chosen_by_numbers_and_ranges(text: str | None, rows: tuple[int, ...]) -> None:
    assert chosen_rows(text, ["estimator"]) == {"estimator": rows}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("99", "there are 1, 2"),
        ("1-", "'1-' is neither"),
        ("x", "'x'"),
        ("²", "^--rows '²': '²' is neither a number nor a range such as 1-5$"),
        ("1-²", "^--rows '1-²': '1-²' is neither a number nor a range such as 1-5$"),
    ],
)
def test_rows_that_do_not_exist_are_refused(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        chosen_rows(text)


def test_a_row_about_a_gauge_is_skipped_where_there_is_none() -> None:
    """It ended with an IndexError, which counts as missed."""
    [row] = [row for row in SAMPLE_ROWS if row.number == 15]
    with pytest.raises(Skipped, match="no such sensor"):
        row.play(SimpleNamespace(of_kind=lambda *_: ()))


def test_a_bound_is_kept_at_its_limit_and_missed_beyond_it() -> None:
    assert Finding("", 1.0, 1.0).passed and not Finding("", 1.0001, 1.0).passed
    assert Finding("", 1.0, 1.0, at_least=True).passed and not Finding("", 0.99, 1.0, at_least=True).passed
    assert not Finding("", float("nan"), 1.0).passed


@pytest.mark.slow
def test_the_command_prints_and_writes_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--json", str(tmp_path / "t.json"), "--html", str(tmp_path / "t.html")]
    assert main(["faults", "--estimator", "single_link", "--rows", "26,27", *files]) == 0
    assert "every sample twice" in capsys.readouterr().out
    page = json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))
    assert page["passed"] and {row[0] for row in page["tables"][0]["rows"]} == {26, 27}
    assert "older than the history" in (tmp_path / "t.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_command_drills_the_controller(tmp_path: Path) -> None:
    assert (
        main(["faults", "--controller", "single_link", "--rows", "40", "--json", str(tmp_path / "t.json")])
        == 0
    )
    page = json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))
    assert page["passed"] and "controller" in page["title"]


@pytest.mark.slow
@pytest.mark.parametrize("machine", MACHINES)
def test_a_payload_is_taken_up_without_a_jump(machine: str) -> None:
    """Gauges and tip read the same; a jump of a coordinate would be 22 %."""
    arm = stand_of(machine).arm
    light = arm.plant
    heavy = Plant(arm.config, light.dt, replace(light.settings, body_mass_scale=1.5))
    light.reset()
    push = np.array([0.1 * axis.effort for axis in arm.config.actuated.values()])
    for _ in range(40):
        light.drive(push)
    take_over(heavy, light)
    assert np.linalg.norm(light.q[len(light.tree.axis_names) :]) > 1e-4  # it bends
    np.testing.assert_allclose(heavy.tip_pose(), light.tip_pose(), atol=1e-9)
    gauges = [i for i, name in enumerate(output_names(arm.config)) if "strain" in name]
    np.testing.assert_allclose(heavy.outputs()[gauges], light.outputs()[gauges], atol=1e-11)


def test_the_seed_reaches_the_stand_and_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    row = replace(ESTIMATOR_ROWS[1], play=lambda seed: [Finding("seed", seed, 3)])
    family = replace(FAMILIES["estimator"], rows={1: row}, make_stand=lambda _, seed: seed)
    monkeypatch.setitem(FAMILIES, "estimator", family)  # type: ignore[index]
    play = ["faults", "planar_3rrr", "--estimator", "--json", str(tmp_path / "t.json")]
    monkeypatch.setattr(
        "flexarm_bringup.fault_drill.drill.run_parallel", lambda do, jobs, _: sum(map(do, jobs), [])
    )
    assert main([*play, "--seed", "3"]) == 0
    assert json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))["seed"] == 3
    assert "Seed 3" in capsys.readouterr().out
    assert main([*play, "--seed", "4"]) == 1
    stand_of.cache_clear()


def test_a_row_that_is_played_in_one_process_and_with_nodes_makes_two_checks_that_are_told_apart() -> None:
    kept = (Finding("tip RMS / e0", 1.0, 1.5),)
    played = [("estimator", 1), ("estimator", 2), ("system", 1), ("controller", 34)]
    results = [RowResult("single_link", family, number, kept) for family, number in played]
    results.append(RowResult("single_link", "system", 4, (), "no such sensor"))
    page = build_page(("estimator", "controller", "system"), ["single_link"], results)
    names = [check.name for check in page.checks]
    assert names[0] == "single_link, row 1 L: strain off for 2 s"
    assert names[2] == "single_link, row 1 N: strain off for 2 s"
    assert len(set(names)) == len(names) == 4
    assert page.lead.startswith("4 checks on 3 rows of the fault matrix, single_link;")
    (table,) = page.items
    assert table.notes == ["row 4 N skipped: no such sensor"]


def test_no_two_rows_of_a_kind_have_one_number() -> None:
    told = [(number, row.kind) for family in FAMILIES.values() for number, row in family.rows.items()]
    assert len(set(told)) == len(told)


def test_an_unknown_machine_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["faults", "--estimator", "no_such_arm"]) == 2
    assert "no_such_arm" in capsys.readouterr().err


def test_rows_of_which_none_applies_are_no_pass(capsys: pytest.CaptureFixture[str]) -> None:
    """An empty table and "passed": true."""
    row = replace(ESTIMATOR_ROWS[7], play=_not_there)
    with pytest.MonkeyPatch.context() as patch:
        family = replace(FAMILIES["estimator"], rows={7: row}, make_stand=lambda _, seed: seed)
        patch.setitem(FAMILIES, "estimator", family)  # type: ignore[index]
        patch.setattr(
            "flexarm_bringup.fault_drill.drill.run_parallel", lambda do, jobs, _: sum(map(do, jobs), [])
        )
        assert main(["faults", "single_link", "--estimator", "--rows", "7"]) == 2
    stand_of.cache_clear()
    assert "nothing was measured: row 7: no such sensor" in capsys.readouterr().err


def _not_there(stand: object) -> list[Finding]:
    raise Skipped("no such sensor")
