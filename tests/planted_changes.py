"""Changes of the code such as slip in: each is planted into the running code, and must be named.

What is patched is what a line of a diff would change; the case that is played has samples for every guard: a
NaN, a duplicate with another value, an outlier.

    python tests/planted_changes.py       # where each is named first, in half a minute
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flexarm_bringup.replaying.replay_bag as replay_bag
import flexarm_controller.exchange as controller_exchange
import flexarm_estimator.exchange as estimator_exchange
import flexarm_estimator.messages.sensor_messages as sensor_messages
import flexarm_estimator.tool.machine_tip as machine_tip
import flexarm_model.bodies.beam as beam
import flexarm_model.tree.sensors as sensors
from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag
from flexarm_bringup.conversions import deserialise, serialise
from flexarm_bringup.regress.judge import judge
from flexarm_bringup.regress.making import Source, make_case
from flexarm_bringup.regress.playing import models
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.judging.checks import SampleChecks
from flexarm_estimator.messages.camera_messages import CameraReader
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.tree.reduced_tree import ReducedTree

Patch = pytest.MonkeyPatch
NAN_AT, TWICE_AT, FAR_AT = 60, 80, 100  # samples of strain, of the encoder, of strain
FAR = 3e-5  # strain
EFFORT, LITTLE = "effort: 28 N m", "effort: 0.1 N m"  # so that the limit binds


@dataclass(frozen=True)
class Planted:
    """A change and where it must be named first: topic, and how the field begins."""

    plant: Callable[[Patch], None]
    topic: str
    field: str


def with_bad_samples(bag: Bag, folder: Path) -> Bag:
    """Write a bag again with a NaN, a duplicate and an outlier in it, recorded of an arm of little torque."""
    description = bag.custom["description"]
    assert EFFORT in description
    bag = replace(bag, custom={**bag.custom, "description": description.replace(EFFORT, LITTLE)})
    (model,) = models(bag)  # a model belongs to one description
    bag = replace(bag, records=tuple(model if r.name == model.name else r for r in bag.records))
    records: list[Record] = []
    seen = dict.fromkeys(("strain", "joint_states"), 0)
    for record in bag.records:
        topic = record.name.rpartition("/")[2]
        records.append(record)
        if topic not in seen:
            continue
        seen[topic] += 1
        if topic == "strain" and seen[topic] in (NAN_AT, FAR_AT):
            value = np.nan if seen[topic] == NAN_AT else FAR
            records[-1] = _edited(record, "strain", value)
        if topic == "joint_states" and seen[topic] == TWICE_AT:
            records.append(_edited(record, "position", 0.3))
    return copy_bag(bag, folder, records)


def _edited(record: Record, field: str, value: float) -> Record:
    msg = deserialise(record.cdr, record.type)
    getattr(msg, field)[0] = value
    return replace(record, cdr=serialise(msg, record.type))


def _setting(kind: type, **changes: float) -> Callable[[Patch], None]:
    """Plant other defaults."""

    def plant(patch: Patch) -> None:
        original = replay_bag.apply_overrides

        def apply_overrides(cls: Any, *args: Any) -> Any:
            settings = original(cls, *args)
            return replace(settings, **changes) if cls is kind else settings

        patch.setattr(replay_bag, "apply_overrides", apply_overrides)

    return plant


def _described(change: Callable[[Any], Any]) -> Callable[[Patch], None]:
    """Plant another reading of the description; its hash stays, as when the reader has the fault."""

    def plant(patch: Patch) -> None:
        original = replay_bag.configuration

        def configuration(bag: Bag) -> Any:
            config, settings = original(bag)
            return change(config), settings

        patch.setattr(replay_bag, "configuration", configuration)

    return plant


def _better_encoder(config: Any) -> Any:
    specs = [
        replace(s, sigma=np.asarray(s.sigma) * 0.5) if s.kind == "encoder" else s for s in config.sensors
    ]
    return replace(config, sensors=tuple(specs))


def stiffer(patch: Patch) -> None:
    original = beam.rigidities
    patch.setattr(beam, "rigidities", lambda piece: tuple(1.01 * value for value in original(piece)))


def sign_of_gauge(patch: Patch) -> None:
    original = sensors._OUTPUT["strain_gauge"]
    patch.setitem(sensors._OUTPUT, "strain_gauge", lambda *args: -original(*args))


def sign_in_jacobian(patch: Patch) -> None:
    original = ReducedTree.tip_jacobian
    flip = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1.0])
    patch.setattr(ReducedTree, "tip_jacobian", lambda self, q: flip @ original(self, q))
    patch.setattr(machine_tip, "_is_compiled", lambda tree: False)  # machine code has its own, to rounding


def swapped_axes(patch: Patch) -> None:
    original = sensor_messages._imu_reader

    def imu_reader(unit: str, specs: Sequence[SensorSpec]) -> Any:
        return original(unit, [replace(spec, channels=("x",)) for spec in specs])

    patch.setattr(sensor_messages, "_imu_reader", imu_reader)


def camera_1_ms_late(patch: Patch) -> None:
    original = CameraReader.read
    patch.setattr(CameraReader, "read", lambda self, msg, t: original(self, msg, t + 1e-3))


def state_1_ms_late(patch: Patch) -> None:
    original = estimator_exchange.state_to_msg
    patch.setattr(estimator_exchange, "state_to_msg", lambda e, model, ns: original(e, model, ns + 1_000_000))


def no_tip(patch: Patch) -> None:
    original = estimator_exchange.EstimatorExchange.step
    patch.setattr(estimator_exchange.EstimatorExchange, "step", lambda self, ns: original(self, ns)[:1])


def nan_passes(patch: Patch) -> None:
    original = SampleChecks._describe
    patch.setattr(
        SampleChecks,
        "_describe",
        lambda self, sensor, value: "" if np.isnan(value) else original(self, sensor, value),
    )


def duplicates_pass(patch: Patch) -> None:
    original = SampleChecks.refuse

    def refuse(self: Any, sample: Any, window: Any) -> str:
        self._known[sample.sensor][-1].clear()  # the stamps that were there
        return original(self, sample, window)

    patch.setattr(SampleChecks, "refuse", refuse)


def weaker(patch: Patch) -> None:
    original = controller_exchange.limits_of

    def limits_of(config: Any) -> Any:
        limits = original(config)
        return replace(limits, effort=0.9 * limits.effort)

    patch.setattr(controller_exchange, "limits_of", limits_of)


GOLDEN = Path(__file__).parent / "golden" / "single_link" / "bag"
PLANTED = {
    "sign of an output row": Planted(sign_of_gauge, "model", "c_pos"),
    "sign in a Jacobian": Planted(sign_in_jacobian, "end_effector", "pose.covariance"),
    "swapped axes of a sensor": Planted(swapped_axes, "modal_state", ""),
    "a weight": Planted(_setting(MpcConfig, position_error=0.0093), "joint_commands", "effort"),
    "camera stamped 1 ms late": Planted(camera_1_ms_late, "modal_state", ""),
    "state stamped 1 ms late": Planted(state_1_ms_late, "modal_state", ""),
    "a lost topic": Planted(no_tip, "end_effector", ""),
    "a wider gate": Planted(_setting(EstimatorConfig, gate=50.0), "modal_state", ""),
    "a NaN that passes": Planted(nan_passes, "modal_state", ""),
    "a duplicate that passes": Planted(duplicates_pass, "modal_state", ""),
    "another latency": Planted(_setting(MpcConfig, latency=1e-3), "joint_commands", "effort"),
    "torque limit": Planted(weaker, "controller_status", "reason"),
    "noise of a sensor": Planted(_described(_better_encoder), "modal_state", ""),
    # a damping ratio is kept, so that the damping moves too; it comes before the stiffness in the message
    "stiffness 1 %": Planted(stiffer, "model", "damping"),
}


def main() -> None:
    """Plant every change by itself and print where it is named first."""
    with tempfile.TemporaryDirectory() as scratch:
        bag = with_bad_samples(check_bag(GOLDEN), Path(scratch) / "recorded")
        folder = make_case(Path(scratch) / "cases" / "bad_samples", Source(bag.path)).folder
        for name, planted in PLANTED.items():
            with pytest.MonkeyPatch.context() as patch:
                planted.plant(patch)
                print(f"{name}: {judge(folder).reason}")


if __name__ == "__main__":
    main()
