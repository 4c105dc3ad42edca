"""Call a service of a running rig, where there is no ros2 command.

  flexarm call                             list the services; --all: those of every node, too
  flexarm call guard/arm                   commands pass from now on
  flexarm call controller/cancel           bring whatever moves to rest
  flexarm call estimator/reset
  flexarm call estimator/toggle_sensor "{name: root_strain, is_on: false}"
  flexarm call controller/move_tip "{target: {position: {x: 0.5543, y: 0.32}}}"
  flexarm call controller/change_state "{transition: {label: deactivate}}"

Services are relative to /flexarm unless they begin with a slash; the request is YAML, what it leaves out has
its default. The answer is printed as YAML. Shorter for what is needed most: flexarm arm, stop, goto.

Exit codes: 0 done; 1 the answer says that it was not, or there is none; 2 no such service or field, or none.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from flexarm_bringup.calling.caller_node import (
    DONE,
    NOT_DONE,
    UNUSABLE,
    Caller,
    absolute,
    add_wait,
    offered,
    operate,
    service_class,
)
from flexarm_bringup.calling.request import fill
from flexarm_bringup.message_fields import pick, written
from flexarm_model.settings.yaml_file import parse_yaml

SUCCESS = ("success", "accepted", "successful")  # fields that say whether it was done


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("service", nargs="?", help="relative to /flexarm, or absolute; none: list them")
    parser.add_argument("request", nargs="?", default="{}", help="YAML; what it leaves out has its default")
    parser.add_argument("--all", action="store_true", help="list parameters' and life's services, too")
    add_wait(parser)


def run(args: argparse.Namespace) -> int:
    """Call, or list; return the exit code."""
    work = _list if args.service is None else _call
    return operate("call", lambda caller: work(caller, args))


def _call(caller: Caller, args: argparse.Namespace) -> int:
    values = parse_yaml(args.request, "the request")
    service = absolute(args.service)
    kind = service_class(caller.type_of(service, args.wait))
    request = kind.Request()
    fill(request, values)
    answer = caller.ask(service, kind, request, args.wait)
    print(written(pick(answer, "")), end="")
    return DONE if was_done(answer) else NOT_DONE


def was_done(answer: Any) -> bool:
    """Return whether an answer says that what was asked for was done; who says nothing has done it."""
    several = getattr(answer, "results", ())  # of parameters that are set; "result" of all at once
    told = [answer, getattr(answer, "result", None), *(several if isinstance(several, list) else ())]
    return all(getattr(each, name, True) for each in told for name in SUCCESS)


def _list(caller: Caller, args: argparse.Namespace) -> int:
    caller.listen(args.wait)
    own = f"{caller.get_fully_qualified_name()}/"
    found = {name: kind for name, kind in caller.seen().items() if not name.startswith(own)}
    shown = found if args.all else offered(found)
    for name, kind in sorted(shown.items()):
        print(f"{name:42} {kind}")
    if not shown:
        print("flexarm call: nobody offers any. Same ROS_DOMAIN_ID and discovery range?", file=sys.stderr)
    return DONE if shown else UNUSABLE
