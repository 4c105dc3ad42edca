"""An option that would change nothing is refused with what it goes with, and so is one given twice."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.arguments import number, refuse_idle
from flexarm_bringup.identify.idle_options import refuse_idle_options
from flexarm_bringup.identify.options import add_arguments
from flexarm_estimator.drift.proposal import REFRESH


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("drift BAG --minutes 3 --law pd", "--minutes, --law: goes with --simulate"),
        ("drift BAG --change 7 --seed 2 --preset geared", "--change, --seed: goes with --simulate"),
        ("drift BAG --preset geared", "--preset: goes with --manipulator NAME"),
        ("drift --simulate single_link --manipulator x", "--manipulator: names the arm of a bag"),
        ("replay BAG --preset x", "--preset: goes with --manipulator NAME"),
        ("replay BAG --remap /a:=joint_states --output NEW", "--output: not with --remap"),
        ("replay BAG --remap /a:=joint_states --against BAG", "--against: not with --remap"),
        ("regress DIR --manipulator planar_3rrr", "--manipulator: goes with --new CASE --from BAG"),
        ("regress DIR --until 3 --about x --mark slow", "--about, --until, --mark: goes with --new"),
        ("regress DIR --settings {}", "--settings: goes with --new"),
        ("regress DIR --update --png .", "--png: not with --update"),
        ("regress --new NEW --from BAG --update", "--update: goes with a folder of cases"),
        (
            "identify run.csv --output-only --manipulator single_link --update a.yaml",
            "--update: not with --out",
        ),
        ("identify run.csv --output-only --estimator H2", "--estimator: not with --output-only"),
        (
            "identify run.csv --output-only --resolution 1",
            "--resolution: with --output-only it goes with rig",
        ),
        (
            "identify BAG --joints --manipulator single_link --band 1 9 --pose 1",
            "--band, --pose: not with --jo",
        ),
        ("identify rig --joints --manipulator single_link --nodes", "--nodes: not with --joints"),
        ("identify A B --joints --manipulator single_link", "--joints takes one source, not 2"),
        (
            "identify run.csv --perturb mass_scale=2 --nodes",
            "--perturb, --nodes: goes with rig as the source",
        ),
        ("identify rig --manipulator single_link --bag NEW", "--bag: goes with --nodes"),
        ("identify run.uff --kind mobility", "--kind: is for the outputs of tables (.csv, .mat, .npz); univ"),
        ("identify BAG --kind receptance", "--kind: is for the outputs of tables"),
        ("identify run.csv --preset geared", "--preset: goes with --manipulator NAME"),
        ("identify run.csv --motors locked", "--motors: goes with --manipulator NAME"),
        (
            "identify rig --manipulator single_link --perturb mass_scale=2 --perturb mass_scale=3",
            "--perturb 'mass_scale=3': mass_scale is 2.0 already",
        ),
        (
            "margins single_link --set mpc.input_jerk=1 --set mpc.input_jerk=2",
            "--set mpc.input_jerk=2: mpc.input_jerk is set twice",
        ),
        ("identify run.csv --save a.npz", "--save: goes with rig, or with bags of a modal test"),
    ],
)
def test_an_option_that_would_change_nothing_is_refused(
    line: str,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: object,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(str(tmp_path))
    assert cli.main(line.split()) == 2
    assert f"flexarm {line.split()[0]}: {said}" in capsys.readouterr().err


def test_what_is_as_by_default_is_not_refused() -> None:
    def add_arguments(parser: argparse.ArgumentParser) -> None:
        parser.add_argument("--least-share", type=number(), default=0.6)
        parser.add_argument("--name", action="append", default=[])

    options = ("--least-share", "--name")
    refuse_idle(argparse.Namespace(least_share=0.6, name=[]), add_arguments, options, "why")
    with pytest.raises(ValueError, match="^--least-share, --name: why$"):
        refuse_idle(argparse.Namespace(least_share=0.0, name=["a"]), add_arguments, options, "why")


def test_what_the_drift_watch_proposes_can_be_followed() -> None:
    """It named an update from the bag of moves, in which no mode was identified."""
    words = REFRESH.partition(": flexarm identify ")[2].replace("NAME", "single_link")
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    args = parser.parse_args(words.replace("[--preset PRESET]", "--preset geared").split())
    refuse_idle_options(args)
    assert (args.files, args.nodes) == ([Path("rig")], "join")
