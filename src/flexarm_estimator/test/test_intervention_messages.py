"""Interventions between messages: read back as they were sent, done at the same step when played again."""

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
from estimator_exchange import EPOCH_NS, PERIOD_NS, exchange, joints, model_conversions
from planar_strip import single_link

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
conversions = pytest.importorskip("flexarm_estimator.interventions.conversions", reason="needs ROS")

from flexarm_estimator.exchange import INTERVENTIONS_TOPIC  # noqa: E402
from flexarm_estimator.interventions.intervention import InterventionError  # noqa: E402
from flexarm_estimator.interventions.reset import Reset  # noqa: E402
from flexarm_estimator.interventions.set_noise import SetNoise  # noqa: E402
from flexarm_estimator.interventions.set_state import SetState  # noqa: E402
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

KNOWN = SetState(
    (0.1,),
    (0.2,),
    (1e-3, 2e-3, 3e-3),
    (0.1, 0.2, 0.3),
    (1e-3,),
    (1e-2,),
    (1e-4,),
    (1e-3,),
    ("base.rz",),
    "id",
)


@pytest.mark.parametrize(
    "intervention",
    [
        Reset(),
        KNOWN,
        SetState((0.1,)),
        ToggleSensor("camera", True),
        ToggleSensor("camera", False, ("rx", "ry", "rz")),
        SetNoise("x", (1.0, 2.0)),
    ],
)
def test_an_intervention_survives_a_message(intervention):
    msg = conversions.intervention_to_msg(intervention, EPOCH_NS)
    assert model_conversions.stamp_to_ns(msg.header.stamp) == EPOCH_NS
    assert conversions.intervention_from_msg(msg) == intervention


def test_a_bag_of_before_switches_whole_sensors():
    old = SimpleNamespace(kind=conversions.InterventionMsg.TOGGLE_SENSOR, name="camera", is_on=False)
    assert conversions.intervention_from_msg(old) == ToggleSensor("camera", False)


def test_a_known_state_has_the_fields_of_its_message():
    names = {item.name for item in fields(SetState)}
    assert names == set(conversions.KnownState.get_fields_and_field_types())


def test_an_unknown_kind_is_refused_by_name():
    msg = conversions.intervention_to_msg(Reset(), 0)
    msg.kind = 9
    with pytest.raises(InterventionError, match=r"kind: 9; allowed: 0 \(Reset\), 1 \(SetState\)"):
        conversions.intervention_from_msg(msg)


def play(made, steps, interventions):
    """Step with a moving encoder; do what is asked for after some steps; return states and what was told."""
    states, told = [], []
    for k in range(steps):
        made.on_sensor("joint_states", joints(EPOCH_NS + k * PERIOD_NS, 0.1 * np.sin(0.05 * k)))
        states += [out.msg for out in made.step(EPOCH_NS + k * PERIOD_NS)]
        told += [out for one in interventions.get(k, ()) for out in made.intervene(one)]
    return states, told


def test_what_was_told_in_a_run_makes_another_run_equal():
    done = {
        10: [SetNoise("encoder", (1e-3,))],
        20: [ToggleSensor("encoder", False)],
        23: [ToggleSensor("camera", False, ("rx", "ry", "rz"))],
        25: [ToggleSensor("encoder", True), SetNoise("disturbance_drift", (1.0,))],
        30: [SetState((0.05,), eta=(1e-3, 0.0, 0.0))],
        40: [Reset()],
    }
    first, told = play(exchange(None), 60, done)
    assert {out.topic for out in told} == {INTERVENTIONS_TOPIC}
    again = exchange(None)
    for out in told:
        again.on_intervention(out.msg)
    assert play(again, 60, {})[0] == first
    assert play(exchange(None), 60, {})[0] != first


def test_an_intervention_acts_from_the_next_step_on():
    made = exchange()
    made.step(0)
    (out,) = made.intervene(ToggleSensor("encoder", False))
    made.on_sensor("joint_states", joints(PERIOD_NS))
    made.step(PERIOD_NS)
    assert model_conversions.stamp_to_ns(out.msg.header.stamp) == 0
    assert made.estimate.sensors[0].status == "off"
    assert made.estimate.sensors[0].accepted == 0


FAR = SetState((0.3,), theta_sigma=(1e-3,))


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ((ToggleSensor("camera", False, ("tx",)), SetNoise("camera", (1e-3,) * 6)), "allowed: 1 or 5"),
        ((ToggleSensor("camera", False, ("tx",)), SetNoise("camera", (1e-3,) * 5)), ""),
        (
            (
                ToggleSensor("camera", False, ("tx", "ty")),
                ToggleSensor("camera", False, ("tz", "rx", "ry", "rz")),
            ),
            "none would be left",
        ),
        ((ToggleSensor("encoder", False), FAR), ""),
        ((ToggleSensor("encoder", True), FAR), "its encoder 'encoder' has it at"),
        ((ToggleSensor("camera", False, ("tx",)), FAR), "its encoder 'encoder' has it at"),
        ((SetState((0.3,), theta_sigma=(0.1,)), FAR), "its encoder 'encoder' has it at 0.0198"),
    ],
)
def test_what_is_asked_for_between_two_steps_is_checked_in_order_and_done_if_it_passes(asked, words):
    """Both were answered with success, and the second was dropped; or refused for what was no more."""
    made = exchange(None)
    play(made, 5, {4: asked[:1]})
    if words:
        with pytest.raises(InterventionError, match=words):
            made.intervene(asked[1])
    else:
        made.intervene(asked[1])
    states = dict.fromkeys((made, expected := exchange(None)))
    play(expected, 5, {})
    for one in asked[: 1 if words else 2]:
        one.apply(expected.estimator)
    for each in states:
        each.on_sensor("joint_states", joints(EPOCH_NS + 5 * PERIOD_NS, 0.0))
        states[each] = each.step(EPOCH_NS + 5 * PERIOD_NS)[0].msg
    assert states[made] == states[expected]
    assert not made.notes.counts


def test_a_model_that_waits_is_used_with_the_noise_of_its_time():
    later = linearize(ReducedTree(single_link(), use_compiler=False), np.array([0.2]))
    noise = {}
    for name, done in (("told", [SetNoise("modal_force", (1.3,))]), ("not told", [])):
        made = exchange()
        made.step(0)
        made.on_model(model_conversions.model_to_msg(later, 2 * PERIOD_NS))
        for one in done:
            made.intervene(one)
        for k in range(1, 4):
            made.step(k * PERIOD_NS)
        assert made.estimator.model.model_id == later.model_id
        noise[name] = made.estimator.past[0].process.force_cov[2, 2]
    assert noise["told"] > 2.0 * noise["not told"]


def test_nothing_is_done_without_a_model_and_the_reason_is_told():
    with pytest.raises(InterventionError, match="no model yet"):
        exchange(with_model=False).intervene(Reset())


def test_an_intervention_of_another_run_is_noted_and_not_done():
    made = exchange()
    made.on_intervention(conversions.intervention_to_msg(ToggleSensor("ghost", False), 0))
    made.step(PERIOD_NS)
    assert "no sensor 'ghost'" in next(iter(made.notes.counts[INTERVENTIONS_TOPIC]))


def test_what_stood_is_done_before_the_first_step_and_before_what_is_asked_for_then():
    """An estimator that had crashed fused again, unheard, what its user had switched off because it lied."""
    crashed, back = exchange(None), exchange(None)
    play(crashed, 3, {1: [ToggleSensor("encoder", False), SetNoise("modal_force", (0.5,))]})
    back.resume(crashed.standing)
    with pytest.raises(InterventionError, match="none would be left"):
        back.intervene(ToggleSensor("root_strain", False, ("strain",)))
    assert back.standing == crashed.standing
    play(back, 1, {})
    assert back.estimate.sensors[0].status == "off"
    assert not back.notes.counts


def test_what_stood_and_cannot_be_done_is_noted():
    back = exchange(None)
    back.resume([ToggleSensor("ghost", False), ToggleSensor("encoder", False)])
    play(back, 1, {})
    assert "no sensor 'ghost'" in next(iter(back.notes.counts[INTERVENTIONS_TOPIC]))
    assert back.estimate.sensors[0].status == "off"


def test_a_clock_that_is_set_back_does_not_delay_an_intervention():
    made = exchange(None)
    made.step(EPOCH_NS)
    made.intervene(ToggleSensor("encoder", False))
    made.step(EPOCH_NS - 50_000_000_000)
    assert made.estimate.sensors[0].status == "off"
