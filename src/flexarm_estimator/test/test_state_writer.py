"""States and tips as bytes are those of their messages, whatever changes from one to the next."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from planar_strip import run, simulate, strip_model

pytestmark = pytest.mark.ros
serialization = pytest.importorskip("rclpy.serialization", reason="needs ROS")
messages = pytest.importorskip("flexarm_interfaces.msg", reason="needs flexarm_interfaces")
from nav_msgs.msg import Odometry  # noqa: E402

from flexarm_estimator.conversions import state_to_msg, tip_to_msg  # noqa: E402
from flexarm_estimator.state_writer import StateWriter  # noqa: E402

RECORD = simulate(60, np.random.default_rng(30), camera_every=7)
ESTIMATES = run(RECORD, camera_delay=12)
STAMP_NS, PERIOD_NS = 1_700_000_000_123_456_789, 5_000_000


def read(told: object, kind: type) -> object:
    """Return the message that a publisher is given, as one or as its bytes."""
    return serialization.deserialize_message(told, kind) if isinstance(told, bytes) else told


def stamps() -> Iterator[int]:
    """Yield a stamp for every estimate."""
    yield from (STAMP_NS + k * PERIOD_NS for k in range(len(ESTIMATES)))


def test_states_are_those_of_the_messages_and_nearly_all_are_bytes() -> None:
    writer, model = StateWriter(serialization.serialize_message), strip_model()
    told = [writer.state(e, model, ns) for e, ns in zip(ESTIMATES, stamps(), strict=True)]
    for raw, estimate, ns in zip(told, ESTIMATES, stamps(), strict=True):
        assert read(raw, messages.ModalState) == state_to_msg(estimate, model, ns)
    texts = [(e.status, e.reason, [(s.status, s.reason) for s in e.sensors]) for e in ESTIMATES]
    changes = sum(a != b for a, b in zip(texts, texts[1:], strict=False))
    assert sum(isinstance(raw, bytes) for raw in told) >= len(told) - 2 * (1 + changes) > len(told) // 2


def test_tips_are_those_of_the_messages() -> None:
    writer = StateWriter(serialization.serialize_message)
    told = [writer.tip(e, ns) for e, ns in zip(ESTIMATES, stamps(), strict=True)]
    for raw, estimate, ns in zip(told, ESTIMATES, stamps(), strict=True):
        assert read(raw, Odometry) == tip_to_msg(estimate, ns)
    assert all(isinstance(raw, bytes) for raw in told[2:])
