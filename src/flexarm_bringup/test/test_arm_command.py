"""`flexarm arm` waits while the loop is judged where the arm was stopped, and for nothing else."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from flexarm_bringup.calling import arm_node  # noqa: E402
from flexarm_controller.margins.arming import ELSEWHERE  # noqa: E402


class FakeCaller:
    """Answers one after the other; a refusal lasts."""

    def __init__(self, *answers):
        self.answers, self.asked = list(answers), 0

    def ask(self, service, kind, request, wait):
        self.asked += 1
        message = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        return SimpleNamespace(success=message == "armed", message=message)

    def listen(self, seconds):
        assert seconds == arm_node.ASK_PERIOD


def test_a_verdict_that_is_under_way_is_waited_for(capsys):
    caller = FakeCaller(f"controller: {ELSEWHERE}", f"controller: {ELSEWHERE}", "armed")
    assert arm_node._arm(caller, 1.0) == 0 and caller.asked == 3
    assert capsys.readouterr().err.count("waits until the loop has been judged") == 1


@pytest.mark.parametrize("why", ["the arm moves", "margins: mode 2 is unstable"])
def test_what_is_refused_is_not_asked_again(why, capsys):
    caller = FakeCaller(why)
    assert arm_node._arm(caller, 1.0) == 1 and caller.asked == 1
    assert capsys.readouterr().err == f"flexarm arm: refused: {why}\n"


def test_a_verdict_that_does_not_come_is_not_waited_for_for_ever(monkeypatch):
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(arm_node.time, "monotonic", lambda: clock.now)
    caller = FakeCaller(ELSEWHERE)
    caller.listen = lambda seconds: setattr(clock, "now", clock.now + seconds)
    assert arm_node._arm(caller, 1.0) == 1
    assert clock.now == pytest.approx(arm_node.JUDGING)
