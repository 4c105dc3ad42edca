"""The laws a controller can be asked for, by name, and everything it keeps ready for one model.

A law is a planner: it answers a state with the torques of the coming periods, or with an empty plan that
says why there is none. A law without foresight is a planner of one period. A new law is one line in ``LAWS``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.damping import JointDamping
from flexarm_controller.firm_mpc import FirmMpc, Soft
from flexarm_controller.joint_pd import JointPd
from flexarm_controller.learned.learning import Learning
from flexarm_controller.learning_mpc import LearningMpc
from flexarm_controller.limits import Limits
from flexarm_controller.local_law import LocalLaw
from flexarm_controller.lqr import Lqr
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.moving_mpc import MovingMpc
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.nonlinear.arm_equations import NonlinearModelError
from flexarm_controller.nonlinear.nonlinear_arm import NonlinearArm
from flexarm_controller.nonlinear.nonlinear_mpc import NonlinearMpc
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.program.beyond import ArmAhead, TorqueBeyond
from flexarm_controller.program.delay import torques_kept
from flexarm_controller.program.foresight import Foresight
from flexarm_controller.program.stage import Stage, build_stage
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.solvers.qp import QpResult
from flexarm_controller.state import ArmState
from flexarm_controller.trust import deviation_scale
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
LawAbout = Callable[[ArmState, Array, Array], LocalLaw]  # state, torques sent, torque


class Planner(Protocol):
    """A law that answers a state with the torques of the coming periods."""

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan the torques that follow those already ``sent``, (max(delay, 1), n_u); maybe an empty plan."""
        ...

    def work_ahead(self) -> None:
        """Do what can be done before the next state is known, once the torque is sent; may be left out."""
        ...


class Feedback(Protocol):
    """A law that answers every state with a torque."""

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Array:
        """Return the torque that follows those already ``sent``, not yet limited, (n_u,)."""
        ...


class OnePeriod:
    """A feedback law as a planner."""

    def __init__(self, feedback: Feedback, law_about: LawAbout | None = None) -> None:
        """Plan one period by ``feedback``; ``law_about`` tells what it does near a state."""
        self._feedback, self._law_about = feedback, law_about

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Return the plan of one period; see ``Planner``."""
        torque = self._feedback.step(state, reference, sent)
        local = None if self._law_about is None else partial(self._law_about, state, sent.copy(), torque)
        return Plan(torque[None], QpResult(torque, "", 0, 0.0, True), (), local=local)

    def work_ahead(self) -> None:
        """Do nothing; see ``Planner``."""


@dataclass(frozen=True)
class LawInputs:
    """What laws are built from, beside the model.

    Attributes:
        limits: Of the arm.
        config: Law, period, fallbacks.
        mpc: Weights, horizon, solver.
        arm: Its description, for laws that need more than the served model; None where nobody knows it.
        nmpc: What the nonlinear controller adds to ``mpc``.
    """

    limits: Limits
    config: ControllerConfig
    mpc: MpcConfig
    arm: ManipulatorConfig | None = None
    nmpc: NmpcConfig = field(default_factory=NmpcConfig)

    @cached_property
    def nonlinear_arm(self) -> NonlinearArm:
        """The equations of the arm, which do not hang on the model.

        Raises:
            NonlinearModelError: Nobody knows the arm, it has loops, or there is no C compiler.
        """
        if self.arm is None:
            raise NonlinearModelError("law 'nmpc' needs the description of the arm")
        return NonlinearArm(self.arm, self.nmpc, self.config.period, self.mpc.horizon)

    @cached_property
    def foresight(self) -> Foresight | None:
        """The models that are to come; None where nobody knows the arm or the settings do not want them."""
        if self.arm is None or not self.mpc.foresight:
            return None
        return Foresight(ReducedTree(self.arm), self.limits, self.mpc, self.config.period)

    @cached_property
    def learning(self) -> Learning:
        """What the laws learn of the arm, which does not hang on the model."""
        return Learning(self.limits.effort.size, self.mpc, self.config.period)

    @cached_property
    def ahead(self) -> ArmAhead | None:
        """The arm along its references; None where nobody knows it or the settings do not want it."""
        if self.arm is None or not self.mpc.arm_torque or self.config.law != "mpc":
            return None
        return ArmAhead(ArmLoads(ReducedTree(self.arm), self.limits))

    def beyond(self, model: ReducedModel) -> TorqueBeyond | None:
        """Return what a model does not know of the torque along a reference, where that is wanted."""
        if self.ahead is None:
            return None
        return TorqueBeyond(model, self.ahead, self.limits, self.mpc, self.config.period)

    def stage_of(self, model: ReducedModel) -> Stage:
        """Return what the program takes from a model; that of the newest is kept for its other laws."""
        if model.model_id not in self._stages:
            self._stages.clear()
            self._stages[model.model_id] = build_stage(model, self.limits, self.mpc, self.config.period)
        return self._stages[model.model_id]

    def stage_made_of(self, model: ReducedModel) -> Stage | None:
        """Return the same if it has been worked out already."""
        return self._stages.get(model.model_id)

    @cached_property
    def _stages(self) -> dict[str, Stage]:
        return {}


def build_mpc(model: ReducedModel, given: LawInputs) -> Planner:
    """Build the predictive controller, along the pose where models to come are known, or one that learns."""
    arguments, mpc = (model, given.limits, given.mpc, given.config.period), given.mpc
    beyond = given.beyond(model)
    soft: Soft
    if given.foresight is not None:
        soft = MovingMpc(*arguments, given.foresight)
    elif mpc.stiffness_step or mpc.inertia_step:
        soft = LearningMpc(*arguments, given.learning, beyond)
    else:
        soft = Mpc(*arguments, given.stage_of(model), beyond)
    return FirmMpc(soft, *arguments, beyond) if mpc.firm_time else soft


def build_lqr(model: ReducedModel, given: LawInputs) -> Planner:
    """Build the linear-quadratic regulator as the law that is asked for."""
    lqr = Lqr(model, given.mpc, given.config.period)
    return OnePeriod(lqr, lqr.law_about)


LAWS: Mapping[str, Callable[[ReducedModel, LawInputs], Planner]] = {
    "mpc": build_mpc,
    "nmpc": lambda model, given: NonlinearMpc(
        model, given.nonlinear_arm, given.limits, given.mpc, given.nmpc
    ),
    "lqr": build_lqr,
    "pd": lambda model, given: OnePeriod(JointPd(model, given.config, given.mpc)),
}


@dataclass(frozen=True)
class Laws:
    """Everything that belongs to one model.

    Attributes:
        model: The model.
        planner: The law that was asked for.
        lqr: What replaces it while the state is good; None for a model that no LQR can stabilise.
        damping: What replaces both.
        scale: Square root of what a deviation of each coordinate of x costs, (2 n,).
    """

    model: ReducedModel
    planner: Planner
    lqr: Feedback | None
    damping: JointDamping
    scale: Array


WEIGHTS = (
    "position_error", "velocity_error", "tip_error", "tip_angle_error", "modal_energy", "input_acceleration",
    "input_jerk",
)  # fmt: skip


def build_laws(model: ReducedModel, given: LawInputs) -> Laws:
    """Build the law that the settings ask for, and its fallbacks.

    Raises:
        ValueError: There is no such law for this arm with these weights.
    """
    try:
        planner = LAWS[given.config.law](model, given)
    except np.linalg.LinAlgError as error:
        said = ", ".join(f"{name} {getattr(given.mpc, name):g}" for name in WEIGHTS)
        raise ValueError(f"no law can be made with {said}: {error}") from None
    try:
        lqr: Feedback | None = Lqr(model, given.mpc, given.config.period, given.stage_made_of(model))
    except np.linalg.LinAlgError:
        lqr = None
    scale = deviation_scale(model, given.mpc, given.config.period)
    delay = torques_kept(given.mpc, given.config.period)
    damping = JointDamping(model, given.config.damping_rate, given.config.period, delay)
    return Laws(model, planner, lqr, damping, scale)
