"""What is converted to a message and back is the same, and a wrong message is named."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.served.steady_filter import SteadyFilter
from flexarm_model.settings.diagnosis import Level, Verdict

pytestmark = pytest.mark.ros
conversions = pytest.importorskip("flexarm_model.conversions", reason="needs ROS and flexarm_interfaces")


def random_model(seed: int, n_theta: int, n_eta: int) -> ReducedModel:
    rng = np.random.default_rng(seed)
    n, n_q, n_y = n_theta + n_eta, n_theta + 2 * n_eta, 9
    omega = np.sort(rng.uniform(10.0, 1000.0, n_eta))
    K = np.zeros((n, n))
    K[:n_theta, :n_theta] = rng.normal(size=(n_theta, n_theta))
    K[range(n_theta, n), range(n_theta, n)] = omega**2
    outputs = Outputs(
        tuple(f"s.{i}" for i in range(n_y)), ("m",) * n_y, rng.normal(size=n_y),
        rng.normal(size=(n_y, n)), rng.normal(size=(n_y, n)), rng.normal(size=(n_y, n)),
    )  # fmt: skip
    return ReducedModel(
        "arm", "0123", tuple(f"j{i}.rz" for i in range(n_theta)), rng.normal(size=n_theta),
        positive(rng.normal(size=(n, n))), rng.normal(size=(n, n)), K, rng.normal(size=(n, n_theta)),
        rng.normal(size=n), omega, rng.uniform(size=n_eta), outputs,
        rng.normal(size=n_q), rng.normal(size=(n_q, n)),
    )  # fmt: skip


def positive(root: Any) -> Any:
    """Return a mass matrix."""
    return root @ root.T + np.eye(len(root))


@pytest.mark.parametrize("stamp_ns", [0, 1, 999_999_999, 5_000_000, 1_700_000_000_123_456_789])
def test_stamps_keep_every_nanosecond(stamp_ns: int) -> None:
    assert conversions.stamp_to_ns(conversions.ns_to_stamp(stamp_ns)) == stamp_ns


@pytest.mark.parametrize(("seed", "n_theta", "n_eta"), [(1, 1, 3), (2, 3, 6), (3, 2, 0)])
def test_a_model_survives_the_wire_bit_for_bit(seed: int, n_theta: int, n_eta: int) -> None:
    from rclpy.serialization import deserialize_message, serialize_message

    model = random_model(seed, n_theta, n_eta)
    sent = serialize_message(conversions.model_to_msg(model, 42, "world"))
    msg = deserialize_message(sent, conversions.ReducedModelMsg)
    back = conversions.model_from_msg(msg)
    assert back.model_id == model.model_id
    assert np.array_equal(back.omega, model.omega)
    assert np.allclose(np.array(msg.f_hz), model.omega / 6.283185307179586, rtol=1e-15)  # one rounding
    assert conversions.stamp_to_ns(msg.header.stamp) == 42


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("mass", [1.0], "mass: 1 numbers, 16 expected"),
        ("f_hz", [], "f_hz: 0 numbers, 3 expected"),
        ("zeta", [0.1, float("nan"), 0.1], "zeta: a number is not finite"),
        ("output_units", ["m"], "output_units: 1 entries, 9 expected"),
        ("pose", [0.5], "model_id: message says"),
        ("model_id", "stale", "model_id: message says 'stale'"),
    ],
)
def test_a_damaged_model_is_refused_by_field(name: str, value: Any, reason: str) -> None:
    msg = conversions.model_to_msg(random_model(4, 1, 3))
    setattr(msg, name, value)
    with pytest.raises(conversions.ModelMessageError, match=reason):
        conversions.model_from_msg(msg)


@pytest.mark.parametrize("factor", [0.0, -1.0])
def test_a_mass_that_no_arm_has_is_refused_though_its_hash_is_right(factor: float) -> None:
    """The controller ended by a singular one."""
    model = random_model(4, 1, 3)
    msg = conversions.model_to_msg(replace(model, M=factor * model.M))
    with pytest.raises(conversions.ModelMessageError, match="mass: is not positive definite"):
        conversions.model_from_msg(msg)


def test_negative_modal_stiffness_is_refused() -> None:
    msg = conversions.model_to_msg(random_model(4, 1, 3))
    msg.stiffness[5] = -1.0
    with pytest.raises(conversions.ModelMessageError, match="model_id"):
        conversions.model_from_msg(msg)


def test_a_model_that_could_not_be_restored_is_not_sent() -> None:
    model = random_model(5, 1, 2)
    K = model.K.copy()
    K[1, 1] *= 1.0 + 1e-9
    changed = {**vars(model), "K": K}
    changed.pop("xi0", None)
    changed.pop("model_id", None)
    with pytest.raises(ValueError, match=r"not omega\^2"):
        conversions.model_to_msg(ReducedModel(**changed))


def random_filter(seed: int) -> SteadyFilter:
    rng = np.random.default_rng(seed)
    F, G, L = rng.normal(size=(7, 7)), rng.normal(size=(7, 2)), rng.normal(size=(7, 3))
    return SteadyFilter("0123", 0.005, ("a.x", "b.y", "b.z"), ("camera",), F, G, L)


def test_a_settled_filter_survives_the_wire_bit_for_bit() -> None:
    sent = random_filter(5)
    found = conversions.filter_from_msg(conversions.filter_to_msg(sent, 7), 2)
    assert (found.model_id, found.dt, found.rows, found.left_out) == ("0123", 0.005, sent.rows, ("camera",))
    for name in ("F", "G", "L"):
        assert np.array_equal(getattr(found, name), getattr(sent, name))


def test_a_settled_filter_with_a_number_too_few_or_none_at_all_is_refused() -> None:
    msg = conversions.filter_to_msg(random_filter(6))
    with pytest.raises(conversions.ModelMessageError, match="g: 14 numbers, 21 expected"):
        conversions.filter_from_msg(msg, 3)
    msg.reason = "no sensor speaks in every control period"
    with pytest.raises(conversions.ModelMessageError, match="no settled filter: no sensor speaks"):
        conversions.filter_from_msg(msg, 2)


def test_a_settled_filter_whose_matrices_do_not_fit_cannot_be_made() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        SteadyFilter("0123", 0.005, ("a.x",), (), np.eye(3), np.ones((3, 1)), np.ones((3, 2)))


def test_a_verdict_travels_as_a_status_and_back() -> None:
    verdict = Verdict("rig: loop", Level.ERROR, "jitter [ms] 9 above 5", {"jitter [ms]": "9", "late": "0"})
    msg = conversions.verdict_to_msg(verdict, "rig")
    assert (msg.level, msg.hardware_id) == (b"\x02", "rig")
    assert conversions.verdict_from_msg(msg) == verdict
