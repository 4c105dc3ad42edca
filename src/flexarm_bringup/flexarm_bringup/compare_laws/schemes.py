"""Everything that is compared: a motion, and the law that makes the arm follow it.

The ideal servo moves the axes exactly as told, whatever torque that takes; no motor does, so its rows are the
best case of open loop. The other laws have motors with the torque limits of the description, sensors and
delay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.compare_laws.legs import ComparedLeg
from flexarm_bringup.compare_laws.open_loop_motions import MOTIONS, LegMotions, plan_motions, robust_choice
from flexarm_bringup.compare_laws.sampled import sample_motion
from flexarm_bringup.tasks.course import Leg, lay_out
from flexarm_bringup.tasks.task import Task
from flexarm_controller.open_loop.axis_motion import Motion
from flexarm_controller.reference import Reference
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
SERVO, PD, LQR, MPC = "ideal servo", "pd", "lqr", "mpc"
LAW_NAMES = {SERVO: "ideal servo", PD: "joint PD", LQR: "LQG", MPC: "MPC"}
WORST = "worst profile"
SCARCE = 0.5  # of what the worst profile asks beyond what holds the arm
ROOM = 1.1  # of the weight on the way and in the range, without which nothing could stop the arm
IDLE = 1e-3  # of a limit: an axis of which a move asks less keeps its own


@dataclass(frozen=True)
class Scheme:
    """One row of the comparison.

    Attributes:
        motion: Name of the motion.
        law: Who makes the axes follow it.
        reference: Of the axes.
        legs: The moves in time.
        end: When everything has been watched [s].
        effort: Torque limits instead of the described ones, (n_theta,); None for those.
    """

    motion: str
    law: str
    reference: Reference
    legs: tuple[Leg, ...]
    end: float
    effort: Array | None = None


@dataclass(frozen=True)
class Case:
    """An arm, its moves, and all open-loop motions of them.

    Attributes:
        task: What the arm does and how it is judged.
        legs: Its moves.
        planned: Open-loop motions by move.
        weight: Largest torque that holds the arm anywhere in its range [N m or N], (n_theta,) or (1,).
    """

    task: Task
    legs: tuple[ComparedLeg, ...]
    planned: Mapping[str, LegMotions]
    weight: Array = field(default_factory=lambda: np.zeros(1))

    @cached_property
    def motions(self) -> dict[str, dict[str, Motion]]:
        """Return the motions that exist for every move, by their name and the move's."""
        first = next(iter(self.planned.values())).motions
        return {
            name: {leg: of_leg.motions[name] for leg, of_leg in self.planned.items()}
            for name in first
            if all(name in of_leg.motions for of_leg in self.planned.values())
        }

    @cached_property
    def chosen(self) -> str:
        """Return the shaped motion that MPC is given: the task's, or the most robust one of the first move.

        Raises:
            ValueError: The task's is not among the motions.
        """
        leg, wanted = self.legs[0], self.task.compare.shaped
        if wanted and wanted not in self.motions:
            raise ValueError(self._not_planned(wanted))
        if wanted:
            return wanted
        by_name = {name: by_leg[leg.name] for name, by_leg in self.motions.items()}
        return robust_choice(leg, self.task.watch, by_name)

    def schemes(self) -> list[Scheme]:
        """Return all rows in the same time."""
        open_loop = [(law, name) for law in (SERVO, PD) for name in self.motions]
        return self._make([*open_loop, *self._closed()])

    def closed_loops(self) -> list[Scheme]:
        """Return the rows whose laws know the modes, and joint PD."""
        return self._make([(PD, WORST), *self._closed()])

    def scarce(self) -> list[Scheme]:
        """Return the worst profile under every law with ``scarce_effort``."""
        return [self.scheme(law, WORST, self.motions[WORST], self.scarce_effort) for law in (PD, LQR, MPC)]

    @cached_property
    def scarce_effort(self) -> Array:
        """Return limits with half of what the worst profile asks beyond the weight [N m or N], (n_theta,)."""
        described = self.legs[0].limits.effort
        peak = np.max([leg.peak(leg.given) for leg in self.legs], axis=0)
        hold = np.max([leg.hold(leg.given) for leg in self.legs], axis=0)
        scarce = np.maximum(
            hold + SCARCE * np.maximum(peak - hold, 0.0), ROOM * np.maximum(hold, self.weight)
        )
        return np.where(peak > IDLE * described, np.minimum(scarce, described), described)

    def scheme(
        self, law: str, name: str, motions: Mapping[str, Motion], effort: Array | None = None
    ) -> Scheme:
        """Return a law that follows one motion per move."""
        sampled = {leg: sample_motion(motion, self.legs[0].dt) for leg, motion in motions.items()}
        return Scheme(name, law, *lay_out(sampled, self.task.lead, self.task.wait), effort)

    def _not_planned(self, wanted: str) -> str:
        """Return why there is no such motion, and which there are."""
        told = [each.left_out[wanted] for each in self.planned.values() if wanted in each.left_out]
        why = f": {told[0]}" if told else ""
        key = f"{self.task.file or self.task.manipulator}: compare.shaped: '{wanted}'"
        return f"{key} cannot be planned{why}; expected one of {'; '.join(self.motions)}"

    def _closed(self) -> list[tuple[str, str]]:
        return [(LQR, WORST), (LQR, self.chosen), (MPC, WORST), (MPC, self.chosen)]

    def _make(self, pairs: Sequence[tuple[str, str]]) -> list[Scheme]:
        return [self.scheme(law, name, self.motions[name]) for law, name in dict.fromkeys(pairs)]


def refuse_unknown_motion(task: Task) -> None:
    """Refuse a moves file that names a motion which is planned for no arm.

    Raises:
        ConfigError: Names file, key, value and what is allowed.
    """
    wanted = task.compare.shaped
    if wanted and wanted not in MOTIONS:
        where = f"{task.file}: " if task.file else ""
        raise ConfigError(f"{where}compare.shaped: '{wanted}': expected one of {'; '.join(MOTIONS)}")


def plan_case(task: Task, legs: tuple[ComparedLeg, ...], is_quick: bool) -> Case:
    """Plan the open-loop motions of every move; quick: without second modes and least torque."""
    return Case(task, legs, {leg.name: plan_motions(leg, task.watch, is_quick) for leg in legs})
