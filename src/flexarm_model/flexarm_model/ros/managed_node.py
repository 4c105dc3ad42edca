"""A node with the life of a managed one: unconfigured, inactive, active, finalized (ROS 2 lifecycle).

A node class overrides ``configure`` (what takes long: models, files) and ``activate`` (topics, services,
timers). What it makes in ``activate`` is destroyed when it is deactivated, what it makes in ``configure``
when it is cleaned up: an inactive node hears nothing, says nothing and advances nothing, because nothing is
there that could, and it starts anew when it is activated again. Latched topics tell it then what it missed.

Publishes
    ~/ready (std_msgs/Bool, latched): false while inactive; else see ``node.ReadyFlag``.
    ~/transition_event (lifecycle_msgs/TransitionEvent)
Services
    ~/change_state, ~/get_state, ... of lifecycle_msgs: what ``ros2 lifecycle`` asks.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleState, TransitionCallbackReturn
from std_msgs.msg import Bool

from flexarm_model.process.punctual import ordinary_priority
from flexarm_model.process.single_instance import claim_name
from flexarm_model.ros.asked_transitions import refuse_unknown_transitions
from flexarm_model.ros.logger_node import FastLogging
from flexarm_model.ros.node import LATCHED_QOS, ReadyFlag
from flexarm_model.ros.tidy_node import TidyNode
from flexarm_model.settings.parameters import parameter

LAST_WORDS = 0.1  # s that they may take to be heard
SUCCESS = TransitionCallbackReturn.SUCCESS
_ENTITIES = {
    "timers": "destroy_timer",
    "subscriptions": "destroy_subscription",
    "services": "destroy_service",
    "clients": "destroy_client",
    "publishers": "destroy_publisher",
}


@dataclass(frozen=True)
class LifeSettings:
    """Settings of every managed node."""

    autostart: bool = parameter(
        True, "Configure and activate at the start; false waits for 'ros2 lifecycle set'."
    )


class ManagedNode(FastLogging, TidyNode):
    """Base of flexarm's nodes; a node class calls ``start`` at the end of its constructor.

    Attributes:
        name_held: What holds its name on this machine.
        is_active: Between activation and deactivation.
        is_finished: It was shut down by a transition; the process ends.
        polled: Subscriptions that no executor hears.
    """

    polled: tuple[Any, ...] = ()

    def __init__(self, name: str) -> None:
        """Be there, unconfigured, in the namespace of flexarm.

        Raises:
            NameTakenError: A node of this name is running; this one has said nothing yet.
        """
        super().__init__(name, namespace="flexarm")
        refuse_unknown_transitions(self)
        self.name_held = claim_name(self.get_fully_qualified_name(), str(self.context.get_domain_id()))
        self.is_active = self.is_finished = False
        self._ready_told = self.create_publisher(Bool, "~/ready", LATCHED_QOS)
        self._ready_told.publish(Bool(data=False))
        self._flag: ReadyFlag | None = None
        self._hook_error: BaseException | None = None
        self._is_started = False
        self._unconfigured = self._inactive = self._made()

    @property
    def subscriptions(self) -> Iterator[Any]:
        """Return what an executor is to hear: all subscriptions but those that are polled."""
        return (each for each in super().subscriptions if each not in self.polled)

    def has_publisher(self, topic: str) -> bool:
        """Return whether somebody speaks on a topic."""
        return bool(self.count_publishers(self.resolve_topic_name(topic)))

    def start(self, settings: LifeSettings) -> None:
        """Configure and activate if that is wanted.

        Raises:
            ParameterError, ConfigError: What was given cannot be used.
        """
        self._unconfigured = self._inactive = self._made()
        for transition in (self.trigger_configure, self.trigger_activate) if settings.autostart else ():
            if transition() != SUCCESS and self._hook_error is not None:
                raise self._hook_error
        self._is_started = True

    def configure(self) -> None:
        """Make what takes long and lasts until ``release``."""

    def activate(self) -> None:
        """Make the topics, services and timers, and what belongs to one stretch of work."""

    def deactivate(self) -> None:
        """Bring to a safe end what ``activate`` began; its topics, services and timers go by themselves."""

    def release(self) -> None:
        """Give back what ``configure`` took: files, memory."""

    def tell_ready(self, conditions: Mapping[str, Callable[[], bool]], libraries: Sequence[str] = ()) -> None:
        """Tell on ~/ready when all conditions hold and libraries are loaded; call it in ``activate``."""
        self._flag = ReadyFlag(self, conditions, self._ready_told, libraries)

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take the transition; see ``configure``."""
        with ordinary_priority():
            self._do("configure")
        self._inactive = self._made()
        return SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take the transition; see ``activate``."""
        with ordinary_priority():  # a guard that built its exchange kept the rig from running for 60 to 90 ms
            self._do("activate")
        self.is_active = True
        return SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take the transition; see ``deactivate``."""
        self._end_activity(LAST_WORDS)
        return SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Take the transition; see ``release``."""
        self._do("release")
        self._destroy_all_but(self._unconfigured)
        return SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End; the process follows."""
        if state.label == "active":
            self._end_activity()
        if state.label != "unconfigured":
            self._do("release")
        self.is_finished = True
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Become unconfigured after a transition that failed."""
        self.is_active = False
        self._destroy_all_but(self._unconfigured)
        return SUCCESS

    def stop(self) -> None:
        """Shut down in order, whatever the state; called at the end of the process."""
        if not self.is_finished:
            self.trigger_shutdown()

    def _end_activity(self, patience: float = 0.0) -> None:
        """End; what was said last is lost with its publisher unless it is heard before, for so long [s]."""
        self.is_active, self.polled = False, ()
        if self._flag is not None:
            self._flag.withdraw()
        self._do("deactivate")
        end = time.monotonic() + patience
        for publisher in self.publishers if patience else ():
            publisher.wait_for_all_acked(Duration(seconds=max(end - time.monotonic(), 0.0)))
        self._destroy_all_but(self._inactive)

    def _do(self, name: str) -> None:
        """Run a hook; the state machine swallows what it raises, so it is logged and kept here."""
        self._hook_error = None
        try:
            getattr(self, name)()
        except BaseException as error:
            self._hook_error = error
            if self._is_started:
                self.get_logger().error(f"{name}: {type(error).__name__}: {error}")
            raise

    def _made(self) -> dict[str, list[Any]]:
        return {kind: list(getattr(self, kind)) for kind in _ENTITIES}

    def _destroy_all_but(self, kept: Mapping[str, list[Any]]) -> None:
        for kind, destroy in _ENTITIES.items():
            for entity in self._made()[kind]:
                if not any(entity is other for other in kept[kind]):
                    getattr(self, destroy)(entity)
