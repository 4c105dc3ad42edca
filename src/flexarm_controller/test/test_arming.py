"""What stands before the first torque: verdicts are asked for when they can be, and only then."""

from types import SimpleNamespace

from flexarm_controller.margins.arming import ELSEWHERE, HOLD, UNKNOWN, Arming

MODEL, OTHER = SimpleNamespace(model_id="a"), SimpleNamespace(model_id="b")
FILTER = SimpleNamespace(model_id="a")


class FakeGate:
    """Gives verdicts out of a list."""

    def __init__(self, *reasons):
        self.reasons, self.asked = list(reasons), 0

    def judge(self, model, filter_):
        self.asked += 1
        return self.reasons.pop(0)


def test_nothing_may_be_sent_before_the_filter_is_known():
    arming = Arming(FakeGate())
    assert arming.reason == UNKNOWN and not arming.is_known
    assert not arming.look(MODEL, is_armed=False, now=0.0)


def test_a_verdict_waits_for_model_and_filter_that_belong_together():
    gate = FakeGate("")
    arming = Arming(gate)
    arming.take(FILTER)
    assert not arming.look(None, is_armed=False, now=0.0) and not arming.look(OTHER, is_armed=False, now=0.0)
    assert arming.look(MODEL, is_armed=False, now=0.0)
    assert (arming.reason, arming.is_known, gate.asked) == ("", True, 1)
    assert not arming.look(MODEL, is_armed=False, now=0.0)  # once is enough


def test_nothing_is_judged_while_the_arm_is_armed():
    gate = FakeGate("", "margins: mode 2 is unstable")
    arming = Arming(gate)
    arming.take(FILTER)
    arming.look(MODEL, is_armed=False, now=0.0)
    arming.take(FILTER)  # tuned otherwise while it moves
    assert not arming.look(MODEL, is_armed=True, now=0.0) and arming.reason == ""
    assert arming.look(MODEL, is_armed=False, now=0.0) and arming.reason == "margins: mode 2 is unstable"


def test_an_estimator_without_a_settled_filter_is_a_reason_too():
    arming = Arming(FakeGate())
    arming.take(None, "no sensor speaks in every control period")
    assert arming.look(None, is_armed=False, now=0.0) and not arming.look(
        None, is_armed=False, now=0.0
    )  # once is enough
    assert arming.reason == "margins: no sensor speaks in every control period" and arming.is_known


def test_a_filter_that_cannot_be_read_leaves_the_verdict_as_it_is_until_the_arm_is_disarmed():
    arming = Arming(FakeGate(""))
    arming.take(FILTER)
    arming.look(MODEL, is_armed=False, now=0.0)
    arming.take(None, "covariance: a number is not finite")
    assert not arming.look(MODEL, is_armed=True, now=0.0) and arming.reason == ""
    assert arming.look(MODEL, is_armed=False, now=0.0)
    assert arming.reason == "margins: covariance: a number is not finite"


def test_a_filter_replaces_what_was_wrong_with_the_one_before():
    gate = FakeGate("", "margins: mode 2 is unstable")
    arming = Arming(gate)
    arming.take(None, "covariance: a number is not finite")
    arming.take(FILTER)
    assert arming.look(MODEL, is_armed=False, now=0.0) and arming.reason == ""
    arming.take(FILTER)
    arming.take(None, "gain: a number is not finite")  # nor is an older filter judged in its place
    assert (
        arming.look(MODEL, is_armed=False, now=0.0)
        and arming.reason == "margins: gain: a number is not finite"
    )
    assert gate.asked == 1


def test_without_a_gate_everything_may_be_sent():
    arming = Arming(None)
    arming.take(FILTER)
    assert arming.reason == "" and arming.is_known and not arming.look(MODEL, is_armed=False, now=0.0)
    arming.take(None, "no filter")
    assert arming.reason == "" and not arming.look(MODEL, is_armed=False, now=0.0)


def test_a_filter_of_an_earlier_model_is_a_reason_to_ask_for_one_of_the_model_in_use():
    """As a controller finds it that is started again while the arm stands elsewhere."""
    arming = Arming(FakeGate(""))
    assert not arming.wants_filter(OTHER, is_armed=False, now=0.0)  # nothing has been told
    arming.take(FILTER)
    assert arming.wants_filter(OTHER, is_armed=False, now=0.0)
    assert not arming.wants_filter(MODEL, is_armed=False, now=0.0) and not arming.wants_filter(
        None, is_armed=False, now=0.0
    )
    assert not arming.wants_filter(OTHER, is_armed=True, now=0.0)  # settling takes a while
    arming.take(SimpleNamespace(model_id="b"))
    assert arming.look(OTHER, is_armed=False, now=0.0) and arming.is_known
    assert not arming.wants_filter(OTHER, is_armed=False, now=9.0)  # judged
    assert not arming.wants_filter(MODEL, is_armed=True, now=9.0)  # models of a motion ask for nothing
    assert not Arming(None).wants_filter(MODEL, is_armed=False, now=0.0)


def judged(*reasons):
    """Return what has judged MODEL, and the gate."""
    gate = FakeGate(*reasons)
    arming = Arming(gate)
    arming.take(FILTER)
    assert arming.look(MODEL, is_armed=False, now=0.0)
    return arming, gate


def test_an_arm_that_was_stopped_elsewhere_is_judged_there_before_it_is_armed_again():
    """The verdict of home armed it at a pose whose margins are short; only a new controller refused."""
    arming, gate = judged("", "margins: gain margin of mode 1 5.2 dB, 6 dB wanted")
    assert not arming.look(OTHER, is_armed=True, now=1.0) and arming.reason == ""  # it moves
    assert arming.look(OTHER, is_armed=False, now=2.0) and arming.reason == ELSEWHERE  # it was stopped
    assert arming.is_known and not arming.look(OTHER, is_armed=False, now=2.1)  # told once
    assert not arming.wants_filter(OTHER, is_armed=False, now=2.1)  # it may still turn
    assert arming.wants_filter(OTHER, is_armed=False, now=2.01 + HOLD)
    arming.take(SimpleNamespace(model_id="b"))
    assert arming.look(OTHER, is_armed=False, now=2.5) and gate.asked == 2
    assert arming.reason == "margins: gain margin of mode 1 5.2 dB, 6 dB wanted"
    assert not arming.wants_filter(OTHER, is_armed=False, now=9.0)


def test_nothing_is_asked_for_while_an_arm_is_pushed_and_what_is_late_is_not_judged():
    arming, gate = judged("", "")
    for i in range(10):
        model = SimpleNamespace(model_id=f"pose {i}")
        arming.look(model, is_armed=False, now=0.1 * i)
        assert not arming.wants_filter(model, is_armed=False, now=0.1 * i)
    arming.take(SimpleNamespace(model_id="pose 3"))
    assert not arming.look(model, is_armed=False, now=1.0) and arming.reason == ELSEWHERE
    assert arming.wants_filter(model, is_armed=False, now=1.0) and gate.asked == 1
    arming.take(model)
    assert arming.look(model, is_armed=False, now=1.1) and arming.reason == ""


def test_a_stop_at_the_pose_that_was_judged_withholds_nothing():
    arming, gate = judged("")
    assert not arming.look(MODEL, is_armed=True, now=1.0) and not arming.look(MODEL, is_armed=False, now=2.0)
    assert not arming.wants_filter(MODEL, is_armed=False, now=9.0)
    assert arming.reason == "" and gate.asked == 1


def test_where_nothing_may_depend_on_a_clock_the_first_verdict_holds_everywhere():
    arming = Arming(FakeGate(""), hold=float("inf"))
    arming.take(FILTER)
    arming.look(MODEL, is_armed=False, now=0.0)
    assert not arming.look(OTHER, is_armed=False, now=1e9) and arming.reason == ""
    assert not arming.wants_filter(OTHER, is_armed=False, now=1e9)
