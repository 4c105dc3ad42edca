"""A bag as one record in order of time: samples at their own instants, torques between them, models."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Record, decode
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.consistency.acting_torques import acting_torques
from flexarm_bringup.consistency.recording import Recording
from flexarm_bringup.consistency.switched_off import refuse_other_filters, without_switched_off
from flexarm_bringup.consistency.usable_samples import usable_samples
from flexarm_bringup.topics import NAMESPACE
from flexarm_estimator.exchange import INTERVENTIONS_TOPIC
from flexarm_estimator.interventions.conversions import intervention_from_msg
from flexarm_estimator.interventions.intervention import Intervention
from flexarm_estimator.likelihood import Epoch
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.messages.inbox import TORQUE_TOPIC
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_model.conversions import model_from_msg, stamp_to_ns
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
NS = 1e-9


@dataclass(frozen=True)
class Epochs:
    """What the filter can be run over.

    Attributes:
        models: In the order of their use.
        epochs: In order of time; ``parts`` counts the models.
        t: Start, just before the first epoch [s].
        own: Sensors that mostly bring a covariance of their own; their sigma changes nothing.
        remarks: What is left out, a line each.
    """

    models: tuple[ReducedModel, ...]
    epochs: tuple[Epoch, ...]
    t: float
    own: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclass
class _Heard:
    """Everything in a bag that matters, with times [s] where no stamps are named."""

    models: list[tuple[float, ReducedModel]] = field(default_factory=list)
    told: dict[int, Array] = field(default_factory=dict)  # torques by stamp [ns], as the guard let them pass
    measured: dict[int, Array | None] = field(default_factory=dict)  # as the drives had them
    samples: list[Measurement] = field(default_factory=list)
    done: list[tuple[float, Intervention]] = field(default_factory=list)


DRIVES_TOPIC = "joint_states"  # what the drives measure, torques as well
FIRST_STEP = 0.005  # s from the start to the first epoch


def read_epochs(recording: Recording, delays: Mapping[str, float] | None = None) -> Epochs:
    """Return the record of a bag.

    Samples that cannot be read, that the estimator would refuse or of a sensor that was switched off are left
    out. Torques are those that acted for the estimator, too: as the guard told them, else as the drives
    measured them.

    Args:
        recording: The bag.
        delays: How late stamps are where it is not as configured, by sensor [s].

    Raises:
        BagError: It has no model, or no sample, or a user set the state or the noise on the way.
    """
    heard, path, specs = _listen(recording), recording.bag.path, recording.config.sensors
    if not heard.models or not heard.samples:
        raise BagError(f"{path}: has {len(heard.models)} models, {len(heard.samples)} samples")
    late = StampDelays(specs)
    late.resume({**late.in_use, **(delays or {})})
    samples = sorted(late.undo(heard.samples), key=lambda sample: sample.t)
    refuse_other_filters(heard.done, path, samples[0].t)
    usable = usable_samples(without_switched_off(samples, heard.done), specs)
    if not usable.samples:
        raise BagError(f"{path}: none of its samples can be used; {'; '.join(usable.describe())}")
    models = sorted(heard.models, key=lambda item: item[0])
    limits = [axis.effort for axis in recording.config.actuated.values()]
    acted = acting_torques(heard.told, heard.measured, limits)
    torques = [(torque.stamp_ns * NS, torque.tau) for torque in acted]
    epochs = tuple(order_epochs(usable.samples, torques, [t for t, _ in models], len(limits)))
    begin, remarks = epochs[0].t - FIRST_STEP, tuple(usable.describe())
    return Epochs(tuple(model for _, model in models), epochs, begin, usable.own, remarks)


def _listen(recording: Recording) -> _Heard:
    reader, heard = SensorReader(recording.config), _Heard()
    own = TORQUE_TOPIC, "model", INTERVENTIONS_TOPIC
    topics = {f"{NAMESPACE}/{topic}": topic for topic in (*reader.topics, *own)}
    for record in recording.bag.records:
        if record.name in topics:
            _hear(topics[record.name], record, reader, heard)
    return heard


def _hear(topic: str, record: Record, reader: SensorReader, heard: _Heard) -> None:
    msg: Any = decode(record)
    stamp_ns = stamp_to_ns(msg.header.stamp)
    t = stamp_ns * NS
    if topic == "model":
        heard.models.append((t, model_from_msg(msg)))
    elif topic == INTERVENTIONS_TOPIC:
        heard.done.append((t, intervention_from_msg(msg)))
    elif topic == TORQUE_TOPIC:
        tau, _ = reader.read_torque(topic, msg)
        if tau is not None:
            heard.told[stamp_ns] = tau
    else:
        if topic == DRIVES_TOPIC and len(msg.effort):
            heard.measured[stamp_ns], _ = reader.read_torque(topic, msg)
        heard.samples += reader.read(topic, msg, t).samples


def order_epochs(
    samples: Sequence[Measurement],
    torques: Sequence[tuple[float, Array]],
    model_times: Sequence[float],
    n_theta: int,
) -> Iterator[Epoch]:
    """Yield one epoch per instant at which something was sampled or the torque changed."""
    acting, tau, k, i = np.zeros(n_theta), np.zeros(n_theta), 0, 0
    times = np.sort([*(sample.t for sample in samples), *(t for t, _ in torques if t >= samples[0].t)])
    instants = times[np.append(True, np.diff(times) > SAME_INSTANT)]
    for t in instants:
        now: dict[str, Measurement] = {}
        while i < len(samples) and samples[i].t <= t + SAME_INSTANT:
            now.setdefault(samples[i].sensor, samples[i])
            i += 1
        used = max(int(np.searchsorted(model_times, t + SAME_INSTANT, side="right")) - 1, 0)
        yield Epoch(float(t), np.append(acting, 1.0), now, used)
        while k < len(torques) and torques[k][0] <= t + SAME_INSTANT:
            tau = torques[k][1]
            k += 1
        acting = tau
