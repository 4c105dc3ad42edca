"""The estimator between messages: what comes in, what goes out, no topics and no clock.

The node connects it to DDS, the replay to a bag; both therefore do the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flexarm_estimator.conversions import diagnostics_msg, state_to_msg, tip_to_msg
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.conversions import intervention_from_msg, intervention_to_msg
from flexarm_estimator.interventions.intervention import Intervention, InterventionError
from flexarm_estimator.interventions.standing import standing
from flexarm_estimator.messages.inbox import Inbox
from flexarm_estimator.messages.readings import Refusal
from flexarm_estimator.messages.tally import Tally
from flexarm_estimator.parts import Parts
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import NS_PER_S, ModelMessageError, model_from_msg, stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.pending_models import PendingModels
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.same_arm import foreign_model
from flexarm_model.tree.reduced_tree import ReducedTree

INTERVENTIONS_TOPIC = "estimator/interventions"
_AT_ONCE = -1  # ns; before any step


@dataclass(frozen=True)
class Outgoing:
    """A message and the relative topic it goes to."""

    topic: str
    msg: Any


class EstimatorExchange:
    """Owns the estimator and translates.

    Attributes:
        estimator: None until a model has been accepted.
        estimate: The newest one; None before the first.
        model_fault: Why the last model was refused; empty when it was taken.
        notes: Refusals that concern no sensor, by topic.
        write_state: Makes of estimate, model and stamp [ns] what is published of a state.
        write_tip: The same of the tip.
    """

    def __init__(
        self,
        config: ManipulatorConfig,
        settings: EstimatorConfig,
        epoch_ns: int | None,
        told: ManipulatorConfig | None = None,
    ) -> None:
        """Start without a model.

        Args:
            config: The manipulator.
            settings: Of the estimator.
            epoch_ns: Stamp that is time zero [ns]; None takes the first step's, and refuses stamps of zero.
            told: Description whose covariances messages repeat; None where it is that of the manipulator.
        """
        self._config, self._settings, self._epoch_ns = config, settings, epoch_ns
        self._tree = ReducedTree(config)
        self._tree.tip_pose(self._tree.loops.home)  # compiles now, not in the first step
        self._inbox = Inbox(told or config, is_live=epoch_ns is None)
        self._interventions: list[tuple[int, Intervention]] = []
        self._tuning = 0  # grows when parts that wait have become old
        self._pending: PendingModels[tuple[int, Parts]] = PendingModels()
        self._last_ns: int | None = None
        self.estimator: Estimator | None = None
        self.estimate: Estimate | None = None
        self.model_fault = "no model yet"
        self.notes = Tally()
        self.write_state: Callable[[Estimate, ReducedModel, int], Any] = state_to_msg
        self.write_tip: Callable[[Estimate, int], Any] = tip_to_msg

    @property
    def topics(self) -> tuple[str, ...]:
        """Relative topics that ``on_sensor`` wants."""
        return self._inbox.topics

    def keep_time(self, clock: Callable[[], int]) -> None:
        """Live by a clock [ns]: what sensors have said after the instant of a step waits for its own."""
        self._inbox.clock = clock

    @property
    def receipt(self) -> str:
        """What models have been taken, in short; equal at all who took the same."""
        return self._pending.receipt

    def on_model(self, msg: Any) -> list[Outgoing]:
        """Take a model of the same description, to be used from its stamp on; refuse another by name.

        The first one is used at once; the others are prepared now and wait.
        """
        try:
            model = model_from_msg(msg)
        except ModelMessageError as error:
            self.model_fault = f"model refused: {error}"
            return []
        self.model_fault = foreign_model(model, self._config, "the estimator")
        if self.model_fault:
            return []
        self._take(model, stamp_to_ns(msg.header.stamp))
        return []

    def on_sensor(self, topic: str, msg: Any) -> None:
        """Keep a message of a sensor, or the torque that was applied, for the next step."""
        self._inbox.add(topic, msg)

    def step(self, stamp_ns: int) -> list[Outgoing]:
        """Fuse what was taken and tell the state at a stamp [ns]; nothing without a model."""
        return list(self.tell()) if self.advance(stamp_ns) else []

    def advance(self, stamp_ns: int) -> bool:
        """Fuse what was taken up to a stamp [ns]; return whether there is a state to tell now."""
        if self.estimator is None:
            self._inbox.clear()
            return False
        if (refusal := self._inbox.refuse_stamp("joint_states", stamp_ns)) is not None:
            self._refuse([refusal])
            return False
        if self._epoch_ns is None:
            self._epoch_ns = stamp_ns
        self._intervene(stamp_ns)
        self._adopt_due(stamp_ns)
        mail, acting = self._inbox.read(self._epoch_ns, stamp_ns), self._inbox.torque
        self._refuse(mail.refusals)
        for torque in acting.changes_before(stamp_ns, self._last_ns):
            self.estimator.step([], acting.tau, self._seconds(torque.stamp_ns))
            acting.tau = torque.tau
        self.estimate = self.estimator.step(mail.samples, acting.tau, self._seconds(stamp_ns))
        self._last_ns = stamp_ns
        return True

    @property
    def told_ns(self) -> int:
        """Stamp of the newest state [ns]."""
        assert self.estimate is not None
        return round(self.estimate.t * NS_PER_S) + (self._epoch_ns or 0)

    def tell(self, is_heard: Callable[[str], bool] = lambda topic: True) -> Iterator[Outgoing]:
        """Yield the newest state, for which a controller waits, then the tip, of what somebody hears."""
        assert self.estimator is not None and self.estimate is not None
        told_ns = self.told_ns
        if is_heard("modal_state"):
            state = self.write_state(self.estimate, self.estimator.model, told_ns)
            yield Outgoing("modal_state", state)
        if is_heard("end_effector"):
            yield Outgoing("end_effector", self.write_tip(self.estimate, told_ns))

    def intervene(self, intervention: Intervention) -> list[Outgoing]:
        """Do something to the estimator now, between two steps; return what a bag needs to do it again.

        Raises:
            InterventionError: It cannot be done; names field, value and what is allowed.
        """
        if self.estimator is None:
            raise InterventionError(self.model_fault)
        stamp_ns = self._last_ns or 0
        self._intervene(stamp_ns + 1)  # what was asked for before comes before
        self._do(intervention)
        return [Outgoing(INTERVENTIONS_TOPIC, intervention_to_msg(intervention, stamp_ns))]

    @property
    def standing(self) -> tuple[Intervention, ...]:
        """What of all interventions stands, see ``standing``."""
        if self.estimator is None:
            return ()
        return tuple(standing(self.estimator, self._config.sensors, self._settings))

    def resume(self, interventions: Iterable[Intervention]) -> None:
        """Do what stood when the estimator before this one ended, ahead of its first step and other ones."""
        self._interventions += [(_AT_ONCE, each) for each in interventions]

    def on_intervention(self, msg: Any) -> None:
        """Take an intervention of a recorded run, to be done at the first step after its stamp."""
        try:
            self._interventions.append((stamp_to_ns(msg.header.stamp), intervention_from_msg(msg)))
        except InterventionError as error:
            self.notes.note(INTERVENTIONS_TOPIC, str(error))

    def diagnostics(self, stamp_ns: int) -> Any:
        """Return the DiagnosticArray of now."""
        figures = {} if self.estimator is None else self.estimator.figures()
        return diagnostics_msg(self.estimate, self.model_fault, self.refusals(), stamp_ns, figures)

    def refusals(self) -> dict[str, Mapping[str, int]]:
        """Return how much was refused so far, by sensor or topic and reason."""
        of_sensors = {} if self.estimator is None else self.estimator.health.refusals.counts
        return {**self.notes.counts, **of_sensors}

    def _take(self, model: ReducedModel, stamp_ns: int) -> None:
        try:
            if self.estimator is None:
                self.estimator = Estimator(model, self._tree, self._config.sensors, self._settings)
            else:
                self._pending.add(stamp_ns, (self._tuning, self.estimator.prepare(model)))
        except (KeyError, ValueError) as error:
            self.model_fault = f"model refused: {error}"
            return
        self._pending.note(stamp_ns, model.model_id)

    def _intervene(self, stamp_ns: int) -> None:
        """Do what was asked for before ``stamp_ns`` [ns] or right after the last step."""
        waiting, self._interventions = self._interventions, []
        for at, intervention in waiting:
            if at >= stamp_ns and at != self._last_ns:  # the clock may have been set back since
                self._interventions.append((at, intervention))
                continue
            try:
                self._do(intervention)
            except InterventionError as error:  # of another run
                self.notes.note(INTERVENTIONS_TOPIC, str(error))

    def _do(self, intervention: Intervention) -> None:
        assert self.estimator is not None
        intervention.check(self.estimator)
        intervention.apply(self.estimator)
        self._tuning += 1

    def _adopt_due(self, stamp_ns: int) -> None:
        """Go on with the model whose time has come."""
        assert self.estimator is not None
        due = self._pending.due(stamp_ns)
        if due is None or due[1].model.model_id == self.estimator.model.model_id:
            return
        tuning, parts = due
        try:
            self.estimator.adopt(parts if tuning == self._tuning else parts.model)
        except ValueError as error:  # axes of another arm under the same config_id
            self.model_fault = f"model refused: {error}"

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - (self._epoch_ns or 0)) * 1e-9

    def _refuse(self, refusals: Sequence[Refusal]) -> None:
        names = {spec.name for spec in self._config.sensors} if refusals else ()
        for refusal in refusals:
            if refusal.source in names and self.estimator is not None:
                self.estimator.health.note_refusal(refusal.source, refusal.reason)
            else:
                self.notes.note(refusal.source, refusal.reason)
