"""A node whose subscriptions, services and timers call nothing any more once they are destroyed.

Its services do not block it either.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode

from flexarm_model.ros.patient_answers_node import RETRY, PatientAnswers


class _UntilGone:
    """What is called with messages or requests, or when it is time, until its source goes.

    The executor may hold one that has come before: the callback would find its publishers destroyed, and the
    node would end by that. A request is left with the response as it was.
    """

    def __init__(self, callback: Callable[..., Any]) -> None:
        self._callback: Callable[..., Any] | None = callback

    def __call__(self, *args: Any) -> Any:
        if self._callback is None:
            return args[-1] if args else None
        return self._callback(*args)

    def end(self) -> None:
        """Call nothing any more."""
        self._callback = None


class TidyNode(LifecycleNode):  # type: ignore[misc]
    """Base of a node that makes and destroys them while it runs."""

    def __init__(self, name: str, **more: Any) -> None:
        """Be there, as every node is."""
        self._until_gone = dict[Any, _UntilGone]()  # callbacks
        self._answers = dict[Any, PatientAnswers]()
        self._retrying: Any = None
        super().__init__(name, **more)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._retrying = self.create_timer(RETRY, self._retry, clock=steady)  # made here it outlives activity
        self._retrying.cancel()
        for service in self.services:  # those of its lifecycle, which nobody has created by the method below
            if service not in self._answers:
                self._answer_patiently(service)

    def create_subscription(
        self, kind: Any, topic: str, callback: Callable[[Any], None], *args: Any, **more: Any
    ) -> Any:
        """Subscribe as every node does, until it is destroyed: see ``_UntilGone``."""
        heard = _UntilGone(callback)
        made = super().create_subscription(kind, topic, heard, *args, **more)
        self._until_gone[made] = heard
        return made

    def destroy_subscription(self, subscription: Any) -> bool:
        """Hear nothing of it any more."""
        if heard := self._until_gone.pop(subscription, None):
            heard.end()
        return bool(super().destroy_subscription(subscription))

    def create_service(
        self, kind: Any, name: str, callback: Callable[..., Any], *args: Any, **more: Any
    ) -> Any:
        """Offer a service that never blocks the node, until it is destroyed: see ``PatientAnswers``."""
        asked = _UntilGone(callback)
        made = super().create_service(kind, name, asked, *args, **more)
        self._until_gone[made] = asked
        self._answer_patiently(made)
        return made

    def _answer_patiently(self, service: Any) -> None:
        self._answers[service] = answers = PatientAnswers(self, service, lambda: self._retrying.reset())
        service.send_response = answers.send

    def _retry(self) -> None:
        """Send the answers that have waited for their readers."""
        if not any([answers.retry() for answers in list(self._answers.values())]):
            self._retrying.cancel()

    def destroy_service(self, service: Any) -> bool:
        """Answer nobody any more, though the executor may try to with a request that it has taken."""
        if asked := self._until_gone.pop(service, None):
            asked.end()
            self._answers.pop(service).end()
            service.send_response = lambda response, header: None
        return bool(super().destroy_service(service))

    def create_timer(self, period: float, callback: Callable[[], None], *args: Any, **more: Any) -> Any:
        """Call something every ``period`` [s] as every node does, until destroyed: see ``_UntilGone``."""
        due = _UntilGone(callback)
        made = super().create_timer(period, due, *args, **more)
        self._until_gone[made] = due
        return made

    def destroy_timer(self, timer: Any) -> bool:
        """Call nothing for it any more, though it may have been due."""
        if due := self._until_gone.pop(timer, None):
            due.end()
        return bool(super().destroy_timer(timer))
