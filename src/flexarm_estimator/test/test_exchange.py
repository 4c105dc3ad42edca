"""The estimator between messages: torques of the right period, stamps, models, diagnostics."""

import numpy as np
import pytest
from planar_strip import single_link

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_estimator.exchange", reason="needs ROS and flexarm_interfaces")
from estimator_exchange import (  # noqa: E402
    EPOCH_NS,
    PERIOD_NS,
    exchange,
    joints,
    messages,
    model,
    model_conversions,
)
from flexarm_interfaces.msg import StrainArray  # noqa: E402

from flexarm_estimator.interventions.reset import Reset  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402


def torque(stamp_ns, tau):
    msg = messages.JointState(name=["base.rz"], effort=[tau])
    msg.header.stamp = model_conversions.ns_to_stamp(stamp_ns)
    return msg


def seen_torques(made):
    """Record the torque and the time of every step of the estimator."""
    steps, inner = [], made.estimator.step

    def step(samples, tau, t):
        steps.append((round(t / 0.005, 6), float(tau[0])))
        return inner(samples, tau, t)

    made.estimator.step = step
    return steps


def test_the_torque_of_a_period_is_the_one_that_was_applied_when_it_began():
    made = exchange()
    steps = seen_torques(made)
    for k in range(4):
        made.on_sensor("joint_states", joints(k * PERIOD_NS))
        made.step(k * PERIOD_NS)
        made.on_sensor("applied_effort", torque(k * PERIOD_NS, float(k + 1)))
    assert steps == [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]


def test_a_lost_step_does_not_lose_the_torques_in_between():
    made = exchange()
    steps = seen_torques(made)
    made.step(0)
    for k in range(3):
        made.on_sensor("applied_effort", torque(k * PERIOD_NS, float(k + 1)))
    made.on_sensor("joint_states", joints(3 * PERIOD_NS))
    made.step(3 * PERIOD_NS)
    assert steps == [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]


def test_without_a_guard_the_drives_own_torque_is_used():
    made = exchange()
    steps = seen_torques(made)
    for k in range(3):
        made.on_sensor("joint_states", joints(k * PERIOD_NS, effort=[0.5 * k]))
        made.step(k * PERIOD_NS)
    assert steps == [(0.0, 0.0), (1.0, 0.5), (2.0, 1.0)]


def test_drives_that_measured_another_torque_than_was_told_are_right():
    made = exchange()
    steps = seen_torques(made)
    for k in range(5):
        acted = float(k) if k != 3 else -2.0  # the drives braked by themselves in the third period
        made.on_sensor("joint_states", joints(k * PERIOD_NS, effort=[acted]))
        made.step(k * PERIOD_NS)
        made.on_sensor("applied_effort", torque(k * PERIOD_NS, float(k + 1)))
    assert steps == [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, -2.0), (4.0, 4.0)]


@pytest.mark.parametrize("is_first", [True, False])
def test_a_forged_torque_beside_the_real_one_does_not_act(is_first):
    made = exchange()
    steps = seen_torques(made)
    for k in range(4):
        made.on_sensor("joint_states", joints(k * PERIOD_NS, effort=[float(k)]))
        made.step(k * PERIOD_NS)
        told = [torque(k * PERIOD_NS, float(k + 1)), torque(k * PERIOD_NS, 14.0)]
        for msg in reversed(told) if is_first else told:
            made.on_sensor("applied_effort", msg)
    assert steps == [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]


def test_noise_of_the_measured_torque_does_not_matter_where_a_guard_tells_it():
    made = exchange()
    steps = seen_torques(made)
    for k in range(4):
        made.on_sensor("joint_states", joints(k * PERIOD_NS, effort=[k + 0.3]))
        made.step(k * PERIOD_NS)
        made.on_sensor("applied_effort", torque(k * PERIOD_NS, float(k + 1)))
    assert steps[1:] == [(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)]


def test_a_state_carries_the_stamp_it_was_asked_for():
    for epoch_ns, start_ns in ((0, 0), (None, EPOCH_NS + 123)):
        made = exchange(epoch_ns)
        for k in range(200):
            stamp_ns = start_ns + k * PERIOD_NS
            made.on_sensor("joint_states", joints(stamp_ns, 0.1))
            state, tip = made.step(stamp_ns)
            assert model_conversions.stamp_to_ns(state.msg.header.stamp) == stamp_ns
            assert model_conversions.stamp_to_ns(tip.msg.header.stamp) == stamp_ns
        assert state.topic == "modal_state"
        assert tip.topic == "end_effector"
        assert state.msg.theta[0] == pytest.approx(0.1, abs=1e-4)


def test_live_stamps_of_zero_are_dropped_and_told():
    made = exchange(None)
    made.on_sensor("joint_states", joints(0))
    assert made.step(0) == []
    made.on_sensor("joint_states", joints(EPOCH_NS))
    assert made.step(EPOCH_NS)
    assert made.notes.counts["joint_states_timestamp"] == {"stamp is 0 ns": 2}
    names = [status.name for status in made.diagnostics(EPOCH_NS).status]
    assert "estimator: joint_states_timestamp" in names


@pytest.mark.parametrize(("stamp_ns", "is_taken"), [((2**31 - 2) * 10**9, True), (2**31 * 10**9 - 1, False)])
def test_a_stamp_so_near_the_last_that_what_is_told_of_it_would_be_none_is_dropped(stamp_ns, is_taken):
    """Seconds as a float are rounded by a tenth of a microsecond there: to a stamp that no message holds."""
    assert bool(exchange(0).step(stamp_ns)) == is_taken


def test_unknown_joints_are_named_in_diagnostics():
    made = exchange()
    msg = joints(0)
    msg.name = ["elbow.rz"]
    made.on_sensor("joint_states", msg)
    made.step(0)
    text = {status.name: status.message for status in made.diagnostics(0).status}
    assert "unknown joint 'elbow.rz'" in text["estimator: joint_states"]
    assert made.estimate.sensors[0].rejected == 1


def test_a_model_of_another_preset_is_refused_by_name():
    made = exchange(with_model=False)
    made.on_model(model_conversions.model_to_msg(model("light_hub")))
    assert made.estimator is None
    assert made.step(0) == []
    assert "preset 'geared'" in made.model_fault
    assert single_link().config_id in made.model_fault
    assert made.diagnostics(0).status[0].message == made.model_fault


def test_a_model_that_was_changed_on_the_way_is_refused():
    made = exchange(with_model=False)
    msg = model_conversions.model_to_msg(model())
    msg.bias = [1.0] * len(msg.bias)
    made.on_model(msg)
    assert "model refused: model_id" in made.model_fault


def test_a_flood_between_two_steps_does_not_grow():
    made = exchange()
    for k in range(5000):
        made.on_sensor("joint_states", joints(k))
    assert len(made._inbox._waiting) == 1000


def test_reset_starts_anew():
    made = exchange()
    for k in range(50):
        made.on_sensor("joint_states", joints(k * PERIOD_NS, 0.2))
        made.step(k * PERIOD_NS)
    before = np.trace(made.estimate.P)
    made.intervene(Reset())
    made.step(50 * PERIOD_NS)
    assert np.trace(made.estimate.P) > 10 * before
    assert made.estimate.status == "starting"


def test_a_model_is_adopted_at_the_first_step_at_or_after_its_stamp():
    made = exchange()
    later = linearize(ReducedTree(single_link(), use_compiler=False), np.array([0.2]))
    made.on_model(model_conversions.model_to_msg(later, 2 * PERIOD_NS + 1))
    ids = []
    for k in range(5):
        made.on_sensor("joint_states", joints(k * PERIOD_NS))
        ids.append(made.step(k * PERIOD_NS)[0].msg.model_id)
    assert ids == [model().model_id] * 3 + [later.model_id] * 2


def test_the_same_model_again_changes_nothing_but_the_receipt():
    made, other = exchange(), exchange()
    assert made.receipt == other.receipt
    made.on_model(model_conversions.model_to_msg(model(), PERIOD_NS))
    states = [one.step(k * PERIOD_NS)[0].msg for k in range(3) for one in (made, other)]
    assert states[-1] == states[-2]
    assert made.receipt != other.receipt


@pytest.mark.parametrize("jump_ns", [-50_000_000_000, 100_000_000_000])
def test_a_clock_that_jumps_clears_the_history_and_the_output_is_back_in_a_fifth_of_a_second(jump_ns):
    """Fault matrix rows 22 and 23."""
    made = exchange(None)
    statuses, periods = [], []
    for k in range(160):
        now_ns = EPOCH_NS + k * PERIOD_NS + (jump_ns if k >= 80 else 0)
        made.on_sensor("applied_effort", torque(now_ns, 0.1))
        made.on_sensor("joint_states", joints(now_ns, 0.1))
        state = made.step(now_ns)[0].msg
        assert model_conversions.stamp_to_ns(state.header.stamp) == now_ns
        assert np.isfinite([*state.theta, *state.eta, *state.covariance]).all()
        statuses.append(state.status)
        periods += np.diff([instant.t for instant in made.estimator.past[1]]).tolist()
    assert min(periods) > 0.0
    assert max(periods) <= 0.1
    assert statuses[80] != state.OK
    back = next(k for k in range(80, 160) if statuses[k] in (0, 1))
    assert (back - 80) * PERIOD_NS <= 0.2e9


def test_torques_of_the_time_before_a_clock_was_set_back_are_forgotten():
    made = exchange(None)
    made.step(EPOCH_NS + 10 * PERIOD_NS)
    made.on_sensor("applied_effort", torque(EPOCH_NS + 10 * PERIOD_NS, 9.0))
    made.on_sensor("applied_effort", torque(EPOCH_NS, 1.0))
    made.step(EPOCH_NS)
    steps = seen_torques(made)
    for k in range(1, 13):
        made.step(EPOCH_NS + k * PERIOD_NS)
    assert {tau for _, tau in steps} == {1.0}


def strain(stamp_ns):
    msg = StrainArray(names=["root_strain"], strain=[1e-7 * (stamp_ns % 97)])
    msg.header.stamp = model_conversions.ns_to_stamp(stamp_ns)
    return msg


def feed_late(made, periods, ahead_ns=0):
    """Give a node that was held up what waits: topic by topic, then step period by period."""
    for k in periods:
        made.on_sensor("strain", strain(EPOCH_NS + k * PERIOD_NS + ahead_ns))
    for k in periods:
        made.on_sensor("joint_states", joints(EPOCH_NS + k * PERIOD_NS, 1e-6 * k))
        made.step(EPOCH_NS + k * PERIOD_NS)


def test_what_is_ahead_of_a_late_node_waits_for_its_period():
    made = exchange(epoch_ns=None)
    made.keep_time(lambda: EPOCH_NS + 11 * PERIOD_NS)
    feed_late(made, range(10))
    gauge = next(report for report in made.estimate.sensors if report.name == "root_strain")
    assert (gauge.accepted, gauge.rejected) == (10, 0)


def test_what_waits_from_before_the_clock_was_set_back_is_refused_by_name():
    """It would have been fused when its time came again, of an arm that is elsewhere by then."""
    made = exchange(epoch_ns=None)
    made.keep_time(lambda: EPOCH_NS + 60 * 10**9)
    feed_late(made, range(10), ahead_ns=50 * 10**9)
    assert made.refusals()["root_strain"] == {"stamp is in the future": 10}


def test_what_is_ahead_of_the_clock_is_refused_by_name():
    made = exchange(epoch_ns=None)
    made.keep_time(lambda: EPOCH_NS + 11 * PERIOD_NS)
    feed_late(made, range(10), ahead_ns=20 * PERIOD_NS)
    assert made.refusals()["root_strain"] == {"stamp is in the future": 10}
