"""The record of a run, read back from its bag."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Bag, check_bag, decode, stamp_of
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.record import RunRecord
from flexarm_bringup.topics import NAMESPACE

Array = NDArray[np.float64]
NEEDED = ("truth", "applied_effort", "modal_state", "guard_status", "reference")


def read_run(path: Path) -> tuple[RunRecord, dict[str, Any]]:
    """Return a run from time zero of its reference on, and the guard's last words.

    With these, as "told", when it told how many periods had been without a command: (time [s], count).

    Raises:
        BagError: The bag is not whole, or not of a run on the simulated rig.
    """
    names = tuple(f"{NAMESPACE}/{topic}" for topic in NEEDED)
    bag = check_bag(path, names)
    truth, effort, state, guard, reference = (_messages(bag, name) for name in names)
    zero_ns = stamp_of(reference[-1])  # one that came before its models is sent again
    t_ns = [stamp for stamp in map(stamp_of, truth) if stamp >= zero_ns]
    by_stamp = {stamp_of(msg): msg for msg in truth}
    rows = [by_stamp[stamp] for stamp in t_ns]
    if not rows:
        raise BagError(f"{path}: holds nothing after its reference")
    efforts = {stamp_of(msg): np.asarray(msg.effort) for msg in effort}
    states = {stamp_of(msg): msg for msg in state}
    record = RunRecord(
        t=(np.array(t_ns) - zero_ns) * 1e-9,
        theta=np.array([msg.theta for msg in rows]),
        tip=np.array([msg.tip for msg in rows]),
        strain=np.array([msg.strain for msg in rows]),
        relative=np.array([msg.relative_acceleration for msg in rows]),
        tau=_column(t_ns, efforts, np.zeros(len(rows[0].theta))),
        eta=_modes(t_ns, states, lambda msg: np.asarray(msg.eta)),
        eta_sigma=_modes(t_ns, states, _sigma),
        fresh=np.ones(len(rows), dtype=bool),
    )
    last = guard[-1]
    return record, {
        "ticks": int(last.passed + last.ticks_without_command),
        "ticks_without_command": int(last.ticks_without_command),
        "limited": int(last.limited),
        "refused": int(last.refused),
        "reason": str(last.reason),
        "told": [(stamp_of(msg) * 1e-9, int(msg.ticks_without_command)) for msg in guard],
    }


def _messages(bag: Bag, name: str) -> list[Any]:
    return [decode(record) for record in bag.records if record.name == name]


def _column(stamps: Sequence[int], values: dict[int, Array], default: Array) -> Array:
    return np.array([values.get(stamp, default) for stamp in stamps])


def _modes(stamps: Sequence[int], states: dict[int, Any], value: Any) -> Array:
    sample = next(iter(states.values()))
    nothing = np.full(len(sample.eta), np.nan)
    return np.array([value(states[stamp]) if stamp in states else nothing for stamp in stamps])


def _sigma(msg: Any) -> Array:
    size = round(len(msg.covariance) ** 0.5)
    n_theta, n_eta = len(msg.theta), len(msg.eta)
    variance = np.asarray(msg.covariance).reshape(size, size).diagonal()[n_theta : n_theta + n_eta]
    return np.asarray(np.sqrt(variance))
