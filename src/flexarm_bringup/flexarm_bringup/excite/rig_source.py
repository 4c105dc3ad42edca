"""``flexarm identify rig``: the simulated rig as a source of records."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from flexarm_bringup.excite.drive import Drive
from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.excite.measure import MeasuredTest, channels_used, measure
from flexarm_bringup.excite.plan import Wish, plan_excitation
from flexarm_bringup.identify.measurement import Records, SourceError
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_fault_text import parse_faults
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.overrides import apply_overrides

RIG = "rig"  # instead of a file


@dataclass(frozen=True)
class RigTest:
    """A modal test that was asked for.

    Attributes:
        manipulator, preset: The description that is believed.
        pose: At which the arm is held [rad or m]; empty for home.
        wish: What to excite.
        simulation: How the simulated arm differs.
        faults: What is wrong with its sensors, as ``parse_faults`` reads it.
        ignore: Channels or sensors to leave out.
    """

    manipulator: str
    preset: str = ""
    pose: tuple[float, ...] = ()
    wish: Wish = Wish()
    simulation: RigSettings = RigSettings()
    faults: str = ""
    ignore: tuple[str, ...] = ()


def rig_test(args: argparse.Namespace) -> RigTest:
    """Return what was asked for on the command line.

    Raises:
        SourceError: No manipulator is named, or a setting of the rig is not known.
    """
    if not args.manipulator:
        raise SourceError("rig: needs --manipulator NAME: amplitude and band come from its model")
    wish = Wish(
        args.excite, tuple(args.band) if args.band else None, args.resolution, args.periods, args.share
    )
    return RigTest(
        args.manipulator, args.preset, tuple(args.pose), wish, rig_settings(args.perturb), args.faults,
        tuple(args.ignore_channel),
    )  # fmt: skip


def rig_settings(given: Sequence[str]) -> RigSettings:
    """Return the rig's settings from "KEY=VALUE" each.

    Raises:
        SourceError: A key is not known or given twice, or a value no number.
        ParameterError: A value is out of its range.
    """
    allowed: dict[str, type[int] | type[float]] = {
        name: int if isinstance(value, int) else float for name, value in asdict(RigSettings()).items()
    }
    values: dict[str, int | float] = {}
    for text in given:
        key, equals, value = text.partition("=")
        if not equals or key not in allowed:
            raise SourceError(f"--perturb '{text}': expected KEY=VALUE with KEY one of {', '.join(allowed)}")
        if key in values:
            raise SourceError(f"--perturb '{text}': {key} is {values[key]} already; expected it once")
        try:
            values[key] = allowed[key](value)
        except ValueError:
            raise SourceError(f"--perturb '{text}': '{value}' is not a number") from None
    return apply_overrides(RigSettings, values)


def run_rig_test(test: RigTest, say: Callable[[str], None]) -> MeasuredTest:
    """Build the rig, check its sensors, excite it.

    Raises:
        ConfigError, PoseError, ValueError: The test does not fit the arm.
        SourceError: A channel cannot be used, or the guard stopped the arm.
    """
    say("model: building")
    config = starting_at(load_config(find_manipulator(test.manipulator), test.preset), test.pose)
    channels_used(config, test.ignore)
    arm = HeldArm(config)
    plan = plan_excitation(arm, test.wish)
    say("rig: building")
    hardware = Hardware(config, test.simulation, faults=parse_faults(test.faults, config.sensors))
    return measure(Drive(hardware, arm), plan, test.ignore, say)


def save_records(records: Sequence[Records], path: Path) -> tuple[Path, ...]:
    """Write records as .npz files that ``flexarm identify`` reads again; return their paths."""
    written = []
    for number, run in enumerate(records, 1):
        file = path if len(records) == 1 else path.with_name(f"{path.stem}_{number}{path.suffix}")
        n = next(iter(run.outputs.values())).size
        columns: dict[str, Any] = {
            "t": np.arange(n) / run.rate_hz, "repeats": run.repeats, "is_held": run.is_held,
            "is_centred": run.is_centred,
            **({"band_hz": np.array(run.band_hz)} if run.band_hz else {}),
            **{f"in:{name}": values for name, values in run.inputs.items()},
            **{f"out:{name}": values for name, values in run.outputs.items()},
            **{f"ref:{name}": values for name, values in run.instruments.items()},
            **{f"kind:{name}": np.array(run.kinds.get(name, run.kind)) for name in run.outputs},
        }  # fmt: skip
        np.savez(file, **columns)
        written.append(file)
    return tuple(written)
