"""Whatever messages arrive: no exception, and nothing that is not finite ever leaves."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_interfaces.msg", reason="needs ROS and flexarm_interfaces")

from estimator_exchange import EPOCH_NS, PERIOD_NS, exchange, model, model_conversions  # noqa: E402
from message_fuzz import MessageFuzz  # noqa: E402
from rclpy.serialization import serialize_message  # noqa: E402

FAR_NS = 10**13  # clocks are set back by hundreds of seconds
NUMBERS = ("theta", "theta_dot", "eta", "eta_dot", "disturbance", "bias", "covariance")


def assert_sound(outgoing: Any) -> None:
    state, tip = (out.msg for out in outgoing)
    assert serialize_message(state)
    assert serialize_message(tip)
    for name in NUMBERS:
        assert np.isfinite(getattr(state, name)).all(), name
    for health in state.sensors:
        assert np.isfinite([health.age, health.normalised_innovation, *health.innovation]).all()
    position, q, twist = tip.pose.pose.position, tip.pose.pose.orientation, tip.twist.twist
    numbers = [position.x, position.y, position.z, q.x, q.y, q.z, q.w]
    numbers += [getattr(part, axis) for part in (twist.linear, twist.angular) for axis in "xyz"]
    assert np.isfinite([*numbers, *tip.pose.covariance, *tip.twist.covariance]).all()


def feed(seed: int, count: int, epoch_ns: int | None) -> int:
    """Feed ``count`` messages, with models and interventions in between; return how many states came out."""
    made, fuzz, rng = exchange(epoch_ns), MessageFuzz(seed), np.random.default_rng([seed, 1])
    states = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # an overflow inside would be told
        for stamp_ns, messages in fuzz.steps(count, EPOCH_NS if epoch_ns is None else FAR_NS, PERIOD_NS):
            for topic, msg in messages:
                made.on_sensor(topic, msg)
            disturb(made, fuzz, rng, stamp_ns)
            wild = model_conversions.stamp_to_ns(fuzz.stamp(stamp_ns))  # the node steps as joint_states say
            for at in (stamp_ns, *([wild] if rng.random() < 0.05 else [])):
                outgoing = made.step(at)
                states += bool(outgoing)
                if outgoing:
                    assert_sound(outgoing)
    return states


def disturb(made: Any, fuzz: MessageFuzz, rng: np.random.Generator, stamp_ns: int) -> None:
    """Now and then a user, a model, a look at the diagnostics."""
    if rng.random() < 0.01:
        made.on_intervention(fuzz.intervention(stamp_ns))
    if rng.random() < 0.005:
        made.on_model(spoilt_model(rng))
    if rng.random() < 0.02:
        msg = made.diagnostics(EPOCH_NS)
        assert serialize_message(msg)
        texts = [pair.value for status in msg.status for pair in status.values]
        assert not any(word in text.split() for text in texts for word in ("nan", "inf"))


def spoilt_model(rng: np.random.Generator) -> Any:
    """Return a model with one field of wrong size or content."""
    msg = model_conversions.model_to_msg(model(), int(rng.integers(0, 2**31 * 10**9)))
    name = str(
        rng.choice(["mass", "bias", "q0", "phi", "zeta", "c_acc", "model_id", "config_id", "theta_names"])
    )
    value = getattr(msg, name)
    if isinstance(value, str):
        setattr(msg, name, value[:-1])
    elif name == "theta_names":
        msg.theta_names = []
    else:
        spoilt = list(value)
        spoilt[int(rng.integers(len(spoilt)))] = float(rng.choice([np.nan, np.inf, 1e308, 0.123]))
        setattr(msg, name, spoilt if rng.random() < 0.5 else spoilt[:-1])
    return msg


@pytest.mark.parametrize("epoch_ns", [0, None])
def test_a_few_hundred_bad_messages_do_no_harm(epoch_ns: int | None) -> None:
    assert feed(1, 400, epoch_ns) > 50


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_a_hundred_thousand_bad_messages_do_no_harm(seed: int) -> None:
    assert feed(100 + seed, 10_000, 0 if seed % 2 else None) > 1000
