"""What stands before the first torque: verdicts are asked for when they can be, and only then."""

from types import SimpleNamespace

from flexarm_controller.margins.arming import UNKNOWN, Arming

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
    assert not arming.look(MODEL, is_armed=False)


def test_a_verdict_waits_for_model_and_filter_that_belong_together():
    gate = FakeGate("")
    arming = Arming(gate)
    arming.take(FILTER)
    assert not arming.look(None, is_armed=False) and not arming.look(OTHER, is_armed=False)
    assert arming.look(MODEL, is_armed=False)
    assert (arming.reason, arming.is_known, gate.asked) == ("", True, 1)
    assert not arming.look(MODEL, is_armed=False)  # once is enough


def test_nothing_is_judged_while_the_arm_is_armed():
    gate = FakeGate("", "margins: mode 2 is unstable")
    arming = Arming(gate)
    arming.take(FILTER)
    arming.look(MODEL, is_armed=False)
    arming.take(FILTER)  # tuned otherwise while it moves
    assert not arming.look(MODEL, is_armed=True) and arming.reason == ""
    assert arming.look(MODEL, is_armed=False) and arming.reason == "margins: mode 2 is unstable"


def test_an_estimator_without_a_settled_filter_is_a_reason_too():
    arming = Arming(FakeGate())
    arming.take(None, "no sensor speaks in every control period")
    assert arming.look(None, is_armed=False) and not arming.look(None, is_armed=False)  # once is enough
    assert arming.reason == "margins: no sensor speaks in every control period" and arming.is_known


def test_a_filter_that_cannot_be_read_leaves_the_verdict_as_it_is_until_the_arm_is_disarmed():
    arming = Arming(FakeGate(""))
    arming.take(FILTER)
    arming.look(MODEL, is_armed=False)
    arming.take(None, "covariance: a number is not finite")
    assert not arming.look(MODEL, is_armed=True) and arming.reason == ""
    assert arming.look(MODEL, is_armed=False)
    assert arming.reason == "margins: covariance: a number is not finite"


def test_a_filter_replaces_what_was_wrong_with_the_one_before():
    gate = FakeGate("", "margins: mode 2 is unstable")
    arming = Arming(gate)
    arming.take(None, "covariance: a number is not finite")
    arming.take(FILTER)
    assert arming.look(MODEL, is_armed=False) and arming.reason == ""
    arming.take(FILTER)
    arming.take(None, "gain: a number is not finite")  # nor is an older filter judged in its place
    assert arming.look(MODEL, is_armed=False) and arming.reason == "margins: gain: a number is not finite"
    assert gate.asked == 1


def test_without_a_gate_everything_may_be_sent():
    arming = Arming(None)
    arming.take(FILTER)
    assert arming.reason == "" and arming.is_known and not arming.look(MODEL, is_armed=False)
    arming.take(None, "no filter")
    assert arming.reason == "" and not arming.look(MODEL, is_armed=False)


def test_a_filter_of_an_earlier_model_is_a_reason_to_ask_for_one_of_the_model_in_use():
    """As a controller finds it that is started again while the arm stands elsewhere."""
    arming = Arming(FakeGate(""))
    assert not arming.is_of_another(OTHER, is_armed=False)  # nothing has been told
    arming.take(FILTER)
    assert arming.is_of_another(OTHER, is_armed=False)
    assert not arming.is_of_another(MODEL, is_armed=False) and not arming.is_of_another(None, is_armed=False)
    assert not arming.is_of_another(OTHER, is_armed=True)  # settling takes a while
    arming.take(SimpleNamespace(model_id="b"))
    assert arming.look(OTHER, is_armed=False) and arming.is_known
    assert not arming.is_of_another(MODEL, is_armed=False)  # judged; models of a motion ask for nothing
    assert not Arming(None).is_of_another(MODEL, is_armed=False)
