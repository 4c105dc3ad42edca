"""Play recorded bags again and name the first stamp and field where what comes of them has changed.

  flexarm regress DIR                       all cases in a folder: pass, or the first divergence
  flexarm regress DIR --html FILE           the same as a page with the divergence drawn (--png DIR: pictures)
  flexarm regress DIR --update              what comes of the bags now is right: renew golden/, say what moved
  flexarm regress --new DIR/NAME --from BAG make a case of any bag that can be replayed
  flexarm regress --new DIR/NAME --from BAG --manipulator NAME --settings '{"controller": {"law": "pd"}}'
                                            of one that `ros2 bag record` wrote, which does not say how

A case is a folder with bag/, golden/ and expect.yaml, which holds tolerances, counts and SHA-256. pytest
collects such folders, too. Everything goes by the stamps in the bag; the speed of the machine has no say.

The exit code is 0 when all cases pass, 1 when one diverged, 2 when one cannot be judged.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path

from flexarm_bringup.arguments import STDOUT, number, output_folder, refuse_idle
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Page, Table, add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_bringup.regress.case import BY_NODE, are_by_node
from flexarm_bringup.regress.finding import case_name, find_cases
from flexarm_bringup.regress.judge import DIVERGED, PASSED, UNUSABLE, Verdict, judge, one_line
from flexarm_bringup.regress.making import Renewal, Source, make_case, update_case
from flexarm_bringup.regress.page import build_page, renewal_tables
from flexarm_bringup.regress.picture import write_picture
from flexarm_bringup.topics import NAMESPACE

COMMANDS = f"{NAMESPACE}/joint_commands"
OF_NEW = ("--about", "--until", "--manipulator", "--preset", "--settings", "--mark")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the folder, what makes a case, and the report files."""
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR", help="a case, or a folder of cases")
    parser.add_argument("--update", action="store_true", help="renew what the cases expect; say what moved")
    parser.add_argument(
        "--png", type=output_folder, metavar="DIR", help="folder for a picture of every divergence"
    )
    making = parser.add_argument_group("make a case")
    making.add_argument("--new", type=Path, metavar="CASE", help="folder to create")
    making.add_argument("--from", dest="source", type=Path, metavar="BAG", help="bag that it is made of")
    making.add_argument("--about", default="", metavar="TEXT", help="what it is, for the reader")
    making.add_argument(
        "--until", type=number(above=0.0), default=math.inf, metavar="S", help="keep so much of the bag [s]"
    )
    making.add_argument("--manipulator", default="", help="name or file, where the bag does not say")
    making.add_argument("--preset", default="", help="preset of that manipulator")
    making.add_argument(
        "--settings", default="", metavar="JSON", help="parameters over those of the bag, by node"
    )
    making.add_argument("--mark", action="append", default=[], help="mark that pytest gives the case")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Judge, renew or make cases; return the exit code."""
    try:
        _check_arguments(args)
        if args.new:
            return publish(_new(args), args)
        folders = find_cases(args.folder)
        if args.update:
            return _update(args, folders)
    except (ValueError, OSError) as error:  # BagError, ConfigError, ParameterError
        print(f"flexarm regress: {one_line(error)}", file=sys.stderr)
        return UNUSABLE
    verdicts = _judge_all(args.folder, folders)
    codes = [verdict.code for verdict in verdicts]
    if args.png:
        codes.append(_draw(args, verdicts))
    return max(*codes, publish(build_page(args.folder, verdicts, bool(args.html)), args))


def _check_arguments(args: argparse.Namespace) -> None:
    if bool(args.new) != bool(args.source) or bool(args.new) == bool(args.folder):
        raise ValueError("give a folder of cases, or --new CASE and --from BAG; see --help")
    if args.new:
        refuse_idle(args, add_arguments, ("--update", "--png"), "goes with a folder of cases, not with --new")
    else:
        why = "goes with --new CASE --from BAG; what a case is made of stands in its expect.yaml"
        refuse_idle(args, add_arguments, OF_NEW, why)
    if args.update:
        refuse_idle(args, add_arguments, ("--png",), "not with --update, which draws no divergence")
    if args.preset and not args.manipulator:
        raise ValueError(
            f"--preset: '{args.preset}': needs --manipulator; without one, it is as the bag says"
        )
    if args.settings:
        _refuse_settings(args.settings)


def _refuse_settings(text: str) -> None:
    """Refuse settings that are no JSON, not by node, or say a thing twice, of which one would hold."""
    try:
        settings = json.loads(text, object_pairs_hook=_once)
    except json.JSONDecodeError as error:
        raise ValueError(f"--settings: is not JSON: {error}") from None
    except ValueError as error:
        raise ValueError(f"--settings: {error}") from None
    except RecursionError:
        raise ValueError(f"--settings: is nested too deeply; expected {BY_NODE}") from None
    if not are_by_node(settings):
        raise ValueError(f"--settings: {text}: expected {BY_NODE}")


def _once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return a mapping of JSON; ValueError where a key is given twice."""
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"key '{name}' is given twice; give it once")
    return dict(pairs)


def _draw(args: argparse.Namespace, verdicts: list[Verdict]) -> int:
    """Draw what diverged; return the exit code."""
    for verdict in verdicts:
        if verdict.code == DIVERGED:
            try:
                path = write_picture(verdict, args.png, case_name(verdict.folder, args.folder))
            except OSError as error:  # a full disk, say
                print(
                    f"flexarm regress: {args.png}: cannot be drawn into: {one_line(error)}", file=sys.stderr
                )
                return UNUSABLE
            if args.json != STDOUT:
                print(f"drew {path}")
    return PASSED


def _judge_all(root: Path, folders: list[Path]) -> list[Verdict]:
    progress, verdicts = Progress(), []
    for k, folder in enumerate(folders):
        progress.say(f"playing: case {k + 1} of {len(folders)}, {case_name(folder, root)}")
        verdicts.append(judge(folder))
    progress.done()
    for verdict in verdicts:
        if verdict.code == UNUSABLE:
            print(f"flexarm regress: {verdict.reason}", file=sys.stderr)
    return verdicts


def _update(args: argparse.Namespace, folders: list[Path]) -> int:
    """Renew every case that can be; return the exit code."""
    items: list[Table] = []
    checks: list[Check] = []
    as_before = 0
    for path in folders:
        name = case_name(path, args.folder)
        try:
            renewal = update_case(path)
        except (ValueError, OSError) as error:  # BagError, ConfigError, ParameterError
            checks.append(Check(name, "renewed", f"left as it was: {one_line(error)}", False))
            print(f"flexarm regress: {one_line(error)}", file=sys.stderr)
            continue
        checks.append(Check(name, "renewed", _renewed(renewal), True))
        if renewal.left:
            print(f"flexarm regress: {name}: renewed, but {renewal.left}", file=sys.stderr)
        as_before += renewal.is_as_before
        items += renewal_tables(name, renewal)
    renewed = sum(check.passed for check in checks)
    lead = f"{renewed} cases renewed; in {as_before} of them nothing moved."
    code = publish(Page(f"Regression of {args.folder}, renewed", lead, items, checks), args)
    return code if renewed == len(folders) else UNUSABLE


def _renewed(renewal: Renewal) -> str:
    if renewal.is_as_before:
        return "as before"
    topics = {item.topic for item in renewal.recounted}
    recounted = f", messages of {', '.join(sorted(topics))} came or went" if topics else ""
    accepted = ", changed tolerances accepted" if renewal.is_accepted else ""
    return f"{len(renewal.moved)} fields moved{recounted}{accepted}"


def _new(args: argparse.Namespace) -> Page:
    source = Source(
        args.source, args.about, args.manipulator, args.preset, args.settings, args.until, tuple(args.mark)
    )
    case = make_case(args.new, source)
    if not case.golden.counts.get(COMMANDS):
        print(
            f"flexarm regress: {case.folder}: nothing was commanded, so the controller's torques are not "
            "part of the case; a recording with the guard armed has them",
            file=sys.stderr,
        )
    recorded, expected = (sum(pinned.counts.values()) for pinned in (case.bag, case.golden))
    lead = f"{recorded} messages recorded, {expected} expected of them. Read and commit {case.folder}."
    return Page(f"New case {case.folder.name}", lead)
