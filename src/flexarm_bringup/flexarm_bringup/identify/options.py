"""The options of ``flexarm identify``, in groups."""

from __future__ import annotations

import argparse
from pathlib import Path

import scipy

from flexarm_bringup.arguments import named_file, number
from flexarm_bringup.excite.options import add_rig_arguments
from flexarm_bringup.page.report import add_report_arguments
from flexarm_model.identification.spectra import BY_INSTRUMENT, ESTIMATORS
from flexarm_model.modal.frf import KINDS

LINES = 8  # of a window that is tried


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="measurements, or rig: excite the simulated one"
    )
    _add_measurement(parser)
    _add_manipulator(parser)
    _add_results(parser)
    add_rig_arguments(parser)
    add_report_arguments(parser)


def window(text: str) -> str:
    """Return the name of a window; ArgumentTypeError where SciPy has none of that name without parameters."""
    try:
        scipy.signal.get_window(text, LINES)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"'{text}': expected a window of scipy.signal without parameters, such as hann, flattop or boxcar"
        ) from None
    return text


def _add_measurement(parser: argparse.ArgumentParser) -> None:
    """Declare what is to be made of the files."""
    group = parser.add_argument_group("measurements")
    group.add_argument(
        "--band", nargs=2, type=number(at_least=0.0), metavar=("LOW", "HIGH"), help="only these [Hz]"
    )
    group.add_argument(
        "--kind", default="accelerance", choices=sorted(KINDS), help="of outputs of a table; accelerance"
    )
    group.add_argument(
        "--resolution", type=number(above=0.0), metavar="HZ", help="distance of the lines, for records"
    )
    group.add_argument(
        "--window",
        type=window,
        help="for records; hann, or none (boxcar) where the inputs are hits or sweeps",
    )
    group.add_argument(
        "--estimator", default="", choices=(*ESTIMATORS, BY_INSTRUMENT),
        help="for records; Hc where it is known what was asked of the inputs, else H1",
    )  # fmt: skip
    group.add_argument(
        "--output-only", action="store_true", help="of records: modes without any input, by subspaces"
    )
    group.add_argument(
        "--ignore-channel", action="append", default=[], metavar="NAME", help="leave this output out"
    )
    group.add_argument(
        "--coherence",
        type=number(at_least=0.0, at_most=1.0),
        default=0.6,
        metavar="LEAST",
        help="lines below it do not count; 0.6",
    )


def _add_manipulator(parser: argparse.ArgumentParser) -> None:
    """Declare what the measurements are compared with."""
    group = parser.add_argument_group("the arm")
    group.add_argument("--manipulator", metavar="NAME", help="print its frequencies beside")
    group.add_argument("--preset", default="", help="preset of that manipulator")
    group.add_argument("--pose", nargs="+", type=number(), default=[], help="of the test, rad or m; home")
    group.add_argument("--motors", default="free", choices=("free", "locked"), help="in the test; free")


def _add_results(parser: argparse.ArgumentParser) -> None:
    """Declare what is to be found beyond modes."""
    group = parser.add_argument_group("beyond modes")
    group.add_argument(
        "--fit", action="append", default=[], metavar="PATH[=SPREAD]",
        help="parameter of the manipulator to fit; its relative sigma before, 0.3",
    )  # fmt: skip
    group.add_argument(
        "--also", action="append", default=[], metavar="POSE=FILE",
        help="the same at another pose, axes with commas between; --also=-0.5=FILE where it begins with a "
        "minus; the same pose again adds a run of its test, as one of several motors has; the last third of "
        "the poses tests the fit",
    )  # fmt: skip
    group.add_argument(
        "--update", type=named_file, nargs="?", const=Path(), metavar="YAML",
        help="write the fitted description there, or as NAME_fitted.yaml; without --fit fits all it can",
    )  # fmt: skip
    group.add_argument(
        "--retune", type=named_file, nargs="?", const=Path(), metavar="YAML",
        help="write moves with settings for the new description, after a trial on the simulated rig",
    )  # fmt: skip
    group.add_argument(
        "--joints", action="store_true",
        help="friction, rotor inertia and gear stiffness from a bag, records or the rig that moves",
    )  # fmt: skip
