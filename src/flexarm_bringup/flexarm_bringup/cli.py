"""The ``flexarm`` command: one table of subcommands, each imported only when it is used.

A command's module offers ``add_arguments(parser)`` and ``run(args) -> int``; its docstring is its help.
"""

from __future__ import annotations

import argparse
import errno
import importlib
import io
import os
import select
import sys
from collections.abc import Sequence
from dataclasses import dataclass

from flexarm_bringup.arguments import overwritten_file, shared_file
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.worker_error import WorkerError
from flexarm_model.process.announce import announce_on_stderr
from flexarm_model.process.security import SecurityError

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before NumPy: small matrices lose by threads

INTERRUPTED = 130  # what a shell reports for Ctrl-C
FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)  # a disk, a file that may grow no more
CUT_OFF = 141  # and for who writes to a pipe that nobody reads any more

DESCRIPTION = "flexarm: knows how an arm bends, estimates it, and moves it so that the tip arrives still."

EXAMPLES = """\
start here:
  flexarm demo                        build the evidence: move the single-link arm six ways, compare
  flexarm demo --html report.html     the same as a page with plots
  flexarm model single_link           its modes: what bends, who sees it, who drives it
  flexarm demo planar_3rrr            another manipulator's moves, in one process and as nodes over DDS
  flexarm sim single_link             rig, estimator and controller of any manipulator in one process
  flexarm reproduce 002               the published tables of the single-link arm against ours
  flexarm replay BAG                  run a recorded bag through estimator and controller again
  flexarm replay BAG --against GOLDEN say where two runs first differ
  flexarm plot BAG                    what happened in a bag, as one page of plots
  flexarm bench                       how long each step takes

Each command explains itself: flexarm COMMAND --help. What measures reports as JSON with --json FILE.
Exit codes: 0 good, 1 a bound was missed or a run diverged, 2 the input cannot be used.
"""


@dataclass(frozen=True)
class Command:
    """A subcommand: the module that has it, and one line of help."""

    module: str
    help: str


COMMANDS = {
    "demo": Command(
        "flexarm_bringup.demo_run.command", "move the simulated arm with and without control, compare, record"
    ),
    "model": Command(
        "flexarm_bringup.model_view.command", "frequencies, shapes and reach of the modes at a pose"
    ),
    "sim": Command(
        "flexarm_bringup.sim_run.command", "run any manipulator in lockstep: MPC against joint PD"
    ),
    "rig": Command(
        "flexarm_bringup.rig_run.command", "start the simulated rig with its nodes, watch it until Ctrl-C"
    ),
    "compare": Command(
        "flexarm_bringup.compare_laws.command", "every law beside every open-loop motion, in the same time"
    ),
    "reproduce": Command("flexarm_bringup.reproduce", "compare published tables with this model"),
    "faults": Command("flexarm_bringup.faults", "inject faults on the simulated rig: measured against bound"),
    "replay": Command(
        "flexarm_bringup.replaying.replay", "feed a bag through estimator and controller, byte for byte"
    ),
    "regress": Command(
        "flexarm_bringup.regress.command", "play a folder of bags again: what comes of them, is it as it was?"
    ),
    "recover": Command("flexarm_bringup.recover", "save what a killed recorder or a full disk left of a bag"),
    "margins": Command(
        "flexarm_bringup.margins.command", "is the loop stable on modes nobody serves? margins per mode"
    ),
    "plot": Command("flexarm_bringup.bag_plots.command", "plots straight from a bag, as a page or pictures"),
    "consistency": Command(
        "flexarm_bringup.consistency.command",
        "is the estimator as good as it says? NEES and NIS of every machine",
    ),
    "ablate": Command("flexarm_bringup.ablate", "estimate a bag without each sensor: what does it buy?"),
    "smooth": Command("flexarm_bringup.smooth", "estimate a bag looking back: how well is the past known?"),
    "tune": Command(
        "flexarm_bringup.tune", "propose the estimator's noise from a bag, by maximum likelihood"
    ),
    "identify": Command(
        "flexarm_bringup.identify.command", "modes from measurements: frequency, damping, shape, uncertainty"
    ),
    "drift": Command(
        "flexarm_bringup.drift_run.command", "do the modes still run where the description has them?"
    ),
    "doctor": Command(
        "flexarm_bringup.doctor.command", "what keeps this rig from running well, and what to do"
    ),
    "security": Command(
        "flexarm_bringup.security.command", "policies for DDS-Security: what each node may say and hear"
    ),
    "echo": Command("flexarm_bringup.echo_node", "print the messages of a topic, or list the topics"),
    "call": Command("flexarm_bringup.calling.call_node", "call a service of a running rig, or list them"),
    "arm": Command("flexarm_bringup.calling.arm_node", "let commands pass: the arm may move from now on"),
    "stop": Command(
        "flexarm_bringup.calling.stop_node", "brake the arm; nothing moves before it is armed again"
    ),
    "goto": Command(
        "flexarm_bringup.calling.goto_node", "move the tip to X Y [Z] and tell how far it has got"
    ),
    "monitor": Command("flexarm_bringup.monitor.command", "watch a running rig in the terminal, live"),
    "parameters": Command("flexarm_bringup.parameters_command", "every node's parameters, unit and range"),
    "realtime": Command(
        "flexarm_bringup.realtime.command", "does this machine keep real time? guard, controller, commands"
    ),
    "soak": Command(
        "flexarm_bringup.soak.command",
        "moves, faults and restarts for half an hour: leaks, late cycles, stops",
    ),
    "bench": Command("flexarm_bringup.bench", "measure the time of every step, as ratios to a baseline"),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run a subcommand and return its exit code.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Raises:
        SystemExit: After ``--help``, or when the arguments are wrong (code 2).
    """
    _make_writable()
    arguments = list(sys.argv[1:] if argv is None else argv)
    chosen = next((item for item in arguments if not item.startswith("-")), "")
    try:
        parser = build_parser(chosen)
        args, unknown = parser.parse_known_args(arguments)
        if not arguments:
            parser.print_help()
            return UNUSABLE
        if unknown or not args.command:
            getattr(args, "subparser", parser).error(
                f"unrecognized arguments: {' '.join(unknown)}"
            )  # with the usage of the command
        if trouble := shared_file(args) or overwritten_file(args):
            args.subparser.error(trouble)
        announce_on_stderr()
        code = int(importlib.import_module(COMMANDS[args.command].module).run(args))
        sys.stdout.flush()
        return code
    except (SecurityError, WorkerError) as error:  # of commands that open a ROS domain, or use all cores
        print(f"flexarm {chosen}: {error}", file=sys.stderr)
        return UNUSABLE
    except KeyboardInterrupt:  # also while a command's libraries are loaded
        return INTERRUPTED
    except OSError as error:
        return _unwritten(error, chosen)


def _unwritten(error: OSError, chosen: str) -> int:
    """Return the exit code of a command that could not write: nobody reads any more, or a disk is full."""
    if isinstance(error, BrokenPipeError) and _is_cut_off():
        return CUT_OFF
    if error.errno not in FULL:
        raise error
    try:
        sys.stdout.flush()
    except OSError:  # it is the one that is full: what waits for it would be tried once more
        _give_up_stdout()
    print(f"flexarm {chosen}: output cannot be written: {error.strerror}", file=sys.stderr)
    return UNUSABLE


def build_parser(chosen: str) -> argparse.ArgumentParser:
    """Return the parser; only the ``chosen`` command has its module imported and its options."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("flexarm", description=DESCRIPTION, epilog=EXAMPLES, formatter_class=raw)
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    for name, command in COMMANDS.items():
        subparser = subparsers.add_parser(name, help=command.help, formatter_class=raw)
        if name == chosen:
            module = importlib.import_module(command.module)
            subparser.description = module.__doc__
            module.add_arguments(subparser)
            subparser.set_defaults(subparser=subparser)
    return parser


def _make_writable() -> None:
    """Let a command print whatever becomes of it: its exit code tells of its work, not of the terminal.

    A stream that the caller closed leads nowhere; a character that a terminal does not have is a "?".
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:  # in this order each gets its own number again, which no file or socket may have
            setattr(sys, name, open(os.devnull, mode, encoding="utf8"))  # noqa: SIM115 - as long as we live
        elif mode == "w" and isinstance(stream, io.TextIOWrapper) and _may_raise(stream):
            stream.reconfigure(errors="replace")


def _may_raise(stream: io.TextIOWrapper) -> bool:
    """Return whether a stream raises at characters that it does not have; of UTF-8 with escapes none."""
    is_escaping = stream.errors == "surrogateescape"
    return stream.errors == "strict" or (is_escaping and "utf" not in stream.encoding.lower())


def _is_cut_off() -> bool:
    """Tell whether nobody reads the standard output any more ("| head"); what waits for it is given up."""
    poll, stdout = select.poll(), sys.stdout.fileno()
    poll.register(stdout, 0)
    is_cut_off = any(event & select.POLLERR for _, event in poll.poll(0))
    if is_cut_off:
        _give_up_stdout()
    return is_cut_off


def _give_up_stdout() -> None:
    """Have nothing written to the standard output any more, also of what waits for it."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    sys.exit(main())
