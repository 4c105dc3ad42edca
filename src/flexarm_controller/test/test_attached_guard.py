"""The guard's end of the attachment: whether the drives obey it, as far as it can know."""

from types import SimpleNamespace

import pytest

pytest.importorskip("std_srvs.srv")

from std_msgs.msg import String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from flexarm_controller.drives.attachment_node import ASK_AGAIN, DOUBTED, UNTOLD, AttachedGuard  # noqa: E402


class Question:
    """A call of a service: who asked is told the answer when it is there."""

    def add_done_callback(self, callback):
        self.callback = callback

    def answer(self, success, message):
        self.result = lambda: Trigger.Response(success=success, message=message)
        self.callback(self)


class Drives:
    """In place of node and drives: questions wait in ``asked`` until a test answers them."""

    def __init__(self):
        self.asked, self.dropped, self.said = [], [], []

    def create_client(self, kind, name):
        return SimpleNamespace(
            service_is_ready=lambda: True,
            call_async=lambda request: self.asked.append(Question()) or self.asked[-1],
            remove_pending_request=self.dropped.append,
        )

    def create_subscription(self, *given):
        pass

    def create_timer(self, *given, **more):
        pass

    def get_logger(self):
        return SimpleNamespace(info=lambda text: None)


def attached(is_lockstep=False, before=""):
    drives = Drives()
    guard = AttachedGuard(drives, drives.said.append, is_lockstep)
    guard.on_timer()
    drives.asked[-1].answer(True, f"secret {before}".rstrip())
    assert guard.refusal == "" and guard.seal is not None
    return guard, drives


def test_drives_that_come_back_and_tell_nobody_whom_they_obey_are_attached_to_again():
    guard, drives = attached()
    first = guard.seal.fingerprint
    guard.doubt()
    assert guard.unready(True) == DOUBTED
    drives.asked[-1].answer(False, "the arm has not been watched for long enough")
    assert guard.seal is None and drives.said == ["the arm has not been watched for long enough"]
    guard.on_timer()
    drives.asked[-1].answer(True, "another")
    assert guard.unready(True) == "" and guard.seal.fingerprint != first


def test_drives_that_only_stood_still_are_braked_with_the_seal_they_gave():
    guard, drives = attached()
    seal = guard.seal
    guard.doubt()
    assert guard.seal is seal
    drives.asked[-1].answer(False, f"the drives obey guard {seal.fingerprint}")
    assert guard.seal is seal and guard.unready(True) == "" and drives.said == []
    guard.on_timer()
    assert len(drives.asked) == 2


def test_drives_that_obey_another_guard_take_the_seal_away():
    guard, drives = attached()
    guard.doubt()
    drives.asked[-1].answer(False, "the drives obey guard 00000000")
    assert guard.seal is None and guard.unready(True) == "the drives obey guard 00000000"


def test_an_answer_from_before_the_doubt_does_not_settle_it():
    guard, drives = attached()
    guard.doubt()
    early = drives.asked[-1]
    guard.doubt()
    assert drives.dropped == [early]
    early.answer(False, f"the drives obey guard {guard.seal.fingerprint}")
    assert guard.unready(True) == DOUBTED


def test_drives_that_have_died_with_the_question_are_asked_again():
    guard, drives = attached()
    guard.doubt()
    for _ in range(ASK_AGAIN + 2):
        guard.on_timer()
    assert len(drives.asked) == 3 and drives.dropped == [drives.asked[1]]


def test_a_guard_that_the_drives_have_released_asks_again_without_a_doubt():
    guard, drives = attached()
    guard.on_attached(String(data=""))
    guard.on_timer()
    assert guard.seal is None and len(drives.asked) == 2


def test_who_was_let_go_before_must_be_followed_by_a_state_where_time_stands():
    guard, drives = attached(is_lockstep=True, before="drives let go, guard silent for 50 ms")
    assert drives.said == ["drives let go, guard silent for 50 ms"]
    assert (guard.unready(False), guard.unready(True)) == (UNTOLD, "")
