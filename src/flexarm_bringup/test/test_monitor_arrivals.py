"""What the monitor makes of messages: rhythm of topics, models by hash, modes, torques, tip."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.described import described
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

pytestmark = pytest.mark.ros
pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")

from flexarm_interfaces.msg import GuardStatus, ModalState, SensorHealth, Truth  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from rclpy.serialization import serialize_message  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

from flexarm_bringup.bags.cdr import header_stamp_ns  # noqa: E402
from flexarm_bringup.monitor.arrivals import CATCH_UP, Arrivals, newest_common  # noqa: E402
from flexarm_bringup.monitor.conversions import (  # noqa: E402
    axes_of,
    guard_from_msg,
    modes_of,
    sensors_from_msg,
    tip_of,
)
from flexarm_bringup.monitor.model_book import ModelBook  # noqa: E402


def raw(stamp: float, kind: type = Truth) -> bytes:
    msg = kind()
    msg.header.stamp.sec, msg.header.stamp.nanosec = int(stamp), round(stamp % 1 * 1e9)
    return bytes(serialize_message(msg))


def reduced(n_eta: int = 2) -> Any:
    """One axis, two modes; the tip moves in y by both, in x by the second."""
    C = np.array([[0.0, 0.0, 3.0], [0.7, 2.0, 4.0], [0.0, 0.0, 0.0], [9.0, 9.0, 9.0]])
    outputs = SimpleNamespace(names=("tip.tx", "tip.ty", "tip.tz", "gauge.strain"), C_pos=C)
    omega = 2 * np.pi * np.array([5.0, 36.0])
    return SimpleNamespace(
        n_theta=1, n_eta=n_eta, theta_names=("base.rz",), eta_names=("mode_1", "mode_2"), omega=omega,
        zeta=np.array([0.01, 0.02]), outputs=outputs, model_id="served",
    )  # fmt: skip


def state() -> ModalState:
    msg = ModalState(joint_names=["base.rz"], theta=[0.3], names=["mode_1", "mode_2"], eta=[1e-3, -2e-3])
    msg.model_id = "served"
    msg.eta_dot, msg.theta_dot, msg.disturbance = [0.0, 0.0], [0.0], [0.0]
    msg.covariance = np.diag(np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) ** 2).ravel().tolist()
    return msg


def test_stamps_are_read_from_the_bytes() -> None:
    assert header_stamp_ns(raw(12.25)) == 12_250_000_000


def test_a_message_that_is_cut_short_is_counted_and_found_at_no_instant() -> None:
    arrivals = Arrivals("truth", True)
    arrivals.add(1.0, b"\0\1\0\0\1\0")
    assert arrivals.stamps() == [] and arrivals.newest is not None


@pytest.mark.parametrize("covariance", [[], [1.0] * 5, [1.0]])
def test_modes_of_a_state_whose_covariance_nobody_tells_have_no_sigma(covariance: list[float]) -> None:
    msg = state()
    msg.covariance = covariance
    assert all(math.isnan(row.sigma) for row in modes_of(reduced(), msg, {}))


def test_rates_and_jitter_are_those_of_the_arrivals() -> None:
    arrivals, rng = Arrivals("truth", True), np.random.default_rng(2)
    times = np.cumsum(rng.uniform(0.004, 0.006, 400))
    for t in times:
        arrivals.add(t, raw(t))
    row, gaps = arrivals.row(times[-1] + 0.5), np.diff(times[times >= times[0] + CATCH_UP])
    assert row.rate_hz == pytest.approx(1 / gaps.mean(), rel=0.01)
    assert row.jitter == pytest.approx(gaps.std(), rel=0.05)
    assert (row.longest, row.age) == (pytest.approx(gaps.max()), pytest.approx(0.5))
    assert math.isnan(Arrivals("reference", True).row(1.0).rate_hz)


def test_what_waited_before_the_first_look_is_no_rhythm() -> None:
    arrivals = Arrivals("truth", True)
    for t in [*np.linspace(0.0, 1e-3, 50), *np.arange(0.005, 2.0, 0.005)]:  # a queue, then 200 Hz
        arrivals.add(t, raw(t))
        row = arrivals.row(t)
        assert math.isnan(row.rate_hz) or row.rate_hz == pytest.approx(200.0)
        assert row.age == 0.0
    assert row.rate_hz == pytest.approx(200.0) and row.longest == pytest.approx(0.005)


def test_two_topics_are_compared_at_the_newest_instant_that_both_have() -> None:
    a, b = Arrivals("a", True), Arrivals("b", True)
    for k in range(60):
        a.add(k, raw(k))
        b.add(k, raw(k)) if k % 7 == 0 else None
    stamp = newest_common(a, b)
    assert stamp == 56_000_000_000 and header_stamp_ns(a.at(stamp) or b"") == stamp
    assert newest_common(a, Arrivals("c", True)) is None


def test_a_model_is_found_by_its_hash_and_else_the_newest() -> None:
    def read(data: bytes) -> Any:
        if data == b"bad":
            raise ValueError("damaged")
        return SimpleNamespace(model_id=data.decode())

    book = ModelBook(read)
    assert book.find("a") is None
    for data in (b"a", b"bad", b"b", b"c"):
        book.add(data)
    assert [getattr(book.find(name), "model_id", None) for name in ("b", "a", "zzz")] == ["b", "a", "c"]


def test_amplitudes_are_what_a_mode_moves_the_tip_by() -> None:
    first, second = modes_of(reduced(), state(), {"mode_1": 0.5})
    assert (first.f_hz, first.zeta, first.largest) == (pytest.approx(5.0), 0.01, 0.5)
    assert (first.at_tip, first.sigma) == (pytest.approx(2e-3), pytest.approx(2.0 * 2.0))
    assert (second.at_tip, second.sigma) == (pytest.approx(-1e-2), pytest.approx(5.0 * 3.0))
    assert math.isnan(modes_of(reduced(), None, {})[0].at_tip)


def test_amplitudes_of_a_model_that_was_not_heard_are_not_read_by_another() -> None:
    """They were shown as what the newest model's modes move the tip by."""
    told = state()
    told.model_id = "never heard"
    (first, _) = modes_of(reduced(), told, {})
    assert math.isnan(first.at_tip) and math.isnan(first.sigma)


def test_torques_stand_beside_the_limits_of_the_description() -> None:
    config = load_config(find_manipulator("single_link"), "geared")
    applied = JointState(name=["base.rz"], effort=[-3.0])
    (axis,) = axes_of(reduced(), state(), applied, config, [0.02])
    assert (axis.position, axis.error, axis.effort, axis.limit) == (0.3, 0.02, -3.0, 28.0)
    (unknown,) = axes_of(reduced(), None, None, None, ())
    assert math.isinf(unknown.limit) and math.isnan(unknown.effort)


def test_the_error_of_the_tip_is_known_only_where_there_is_a_truth() -> None:
    odometry, truth = Odometry(), Truth(tip=[0.0, 0.003, 0.004, 0.0, 0.0, 0.0])
    odometry.pose.covariance = (np.eye(6) * 1e-6).ravel()
    tip = tip_of(odometry, (odometry, truth), 0.1)
    assert (tip.error, tip.to_goal) == (pytest.approx(0.005), 0.1)
    assert tip.three_sigma == pytest.approx((3e-3,) * 3)
    assert math.isnan(tip_of(odometry, None, math.nan).error)


def test_guard_and_sensors_are_told_in_words() -> None:
    guard = guard_from_msg(GuardStatus(mode=GuardStatus.BRAKING, reason="too fast", refused=4), 0.1)
    assert (guard.mode, guard.reason, guard.refused) == ("braking", "too fast", 4)
    msg = ModalState(sensors=[SensorHealth(name="camera", status=SensorHealth.STALE, age=0.4, rejected=2)])
    (row,) = sensors_from_msg(msg)
    assert (row.name, row.status, row.age, row.rejected) == ("camera", "stale", 0.4, 2)


def test_the_description_with_its_preset_is_found_by_the_hash(tmp_path: Path) -> None:
    light = load_config(find_manipulator("single_link"), "light_hub")
    found = described("single_link", light.config_id)
    assert found is not None and found.preset == "light_hub"
    assert described("single_link", "changed") is None and described("somebody_elses", "x") is None
