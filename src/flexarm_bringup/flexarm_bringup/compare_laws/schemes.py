"""Everything that is compared: a motion, and the law that makes the arm follow it.

The ideal servo moves the axes exactly as told, whatever torque that takes; no motor does, so its rows are the
best case of open loop. The other laws have motors with the torque limits of the description, sensors and
delay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.compare_laws.legs import ComparedLeg
from flexarm_bringup.compare_laws.open_loop_motions import LegMotions, plan_motions, robust_choice
from flexarm_bringup.compare_laws.sampled import sample_motion
from flexarm_bringup.tasks.course import Leg, lay_out
from flexarm_bringup.tasks.task import Task
from flexarm_controller.open_loop.axis_motion import Motion
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
SERVO, PD, LQR, MPC = "ideal servo", "pd", "lqr", "mpc"
LAW_NAMES = {SERVO: "ideal servo", PD: "joint PD", LQR: "LQG", MPC: "MPC"}
WORST = "worst profile"
SCARCE = 0.5  # of the peak torque of the worst profile


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
    """

    task: Task
    legs: tuple[ComparedLeg, ...]
    planned: Mapping[str, LegMotions]

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
            raise ValueError(f"compare: shaped: '{wanted}' is none of {', '.join(self.motions)}")
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
        """Return the worst profile under every law with half the torque that it asks for."""
        effort = SCARCE * np.array([leg.peak(leg.given) for leg in self.legs]).max(axis=0)
        return [self.scheme(law, WORST, self.motions[WORST], effort) for law in (PD, LQR, MPC)]

    def scheme(
        self, law: str, name: str, motions: Mapping[str, Motion], effort: Array | None = None
    ) -> Scheme:
        """Return a law that follows one motion per move."""
        sampled = {leg: sample_motion(motion, self.legs[0].dt) for leg, motion in motions.items()}
        return Scheme(name, law, *lay_out(sampled, self.task.lead, self.task.wait), effort)

    def _closed(self) -> list[tuple[str, str]]:
        return [(LQR, WORST), (LQR, self.chosen), (MPC, WORST), (MPC, self.chosen)]

    def _make(self, pairs: Sequence[tuple[str, str]]) -> list[Scheme]:
        return [self.scheme(law, name, self.motions[name]) for law, name in dict.fromkeys(pairs)]


def plan_case(task: Task, legs: tuple[ComparedLeg, ...], is_quick: bool) -> Case:
    """Plan the open-loop motions of every move; quick: without second modes and least torque."""
    return Case(task, legs, {leg.name: plan_motions(leg, task.watch, is_quick) for leg in legs})
