"""Everything retuned: what was, what is proposed, and by which rule."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.retune.arm_facts import ArmFacts, read_facts
from flexarm_bringup.retune.bench import Settings
from flexarm_bringup.retune.horizon import fit_horizon
from flexarm_bringup.retune.noise import fit_noise
from flexarm_bringup.retune.roll_off import Kept, keep_margins
from flexarm_bringup.retune.search import Search, search, twins_of
from flexarm_bringup.retune.shaping import ShaperChoice, choose_shaper
from flexarm_bringup.retune.weights import scale_weights
from flexarm_bringup.tasks.task import Task
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

RULES = {
    "modal_energy": "the same deviation of the tip costs the same; searched",
    "modal_cutoff_hz": "above the same modes, lower where margins want it",
    "input_acceleration": "as before, less where margins want it; searched",
    "input_jerk": "searched",
    "position_error": "searched",
    "velocity_error": "searched",
    "tip_error": "searched",
    "tip_angle_error": "searched",
    "horizon": "the same share of the slowest period, at least half of it; searched",
    "blocks": "as many as before",
    "firm_time": "as many periods of the slowest mode; 0 where the gate wants it",
    "frequency_error": "three sigma of what is not known",
}


@dataclass(frozen=True)
class Proposal:
    """Settings before and after.

    Attributes:
        before, after: The arm as it was and is described.
        old, new: Settings of estimator and predictive law, by section.
        kept: What the margins asked for.
        searched: What the search found after that.
        shaper: For moves without feedback of the modes.
        doubt: One sigma of the frequencies, relative [1].
    """

    before: ArmFacts
    after: ArmFacts
    old: Settings
    new: Settings
    kept: Kept
    searched: Search
    shaper: ShaperChoice
    doubt: float

    @property
    def changes(self) -> Mapping[str, Mapping[str, Any]]:
        """What differs, by section of a moves file and name."""
        return {
            "estimator": _difference(self.old[0], self.new[0]),
            "mpc": _difference(self.old[1], self.new[1]),
        }


def propose(
    described: ManipulatorConfig,
    updated: ManipulatorConfig,
    task: Task,
    doubt: float,
    say: Callable[[str], None] = lambda text: None,
) -> Proposal:
    """Return settings that fit the updated arm.

    Args:
        described: The arm as it was described when the task's settings were chosen.
        updated: The arm as it is.
        task: With those settings.
        doubt: One sigma of the updated frequencies, relative [1].
        say: Is told what is done.

    Raises:
        ValueError: The two arms have different served modes.
    """
    before, after = (read_facts(linearize(ReducedTree(c, use_compiler=False))) for c in (described, updated))
    if before.f_hz.size != after.f_hz.size:
        raise ValueError(f"served modes: {before.f_hz.size} before, {after.f_hz.size} after the update")
    estimator, mpc = task.make("estimator", EstimatorConfig), task.make("mpc", MpcConfig)
    mpc = replace(mpc, time_limit=0.0)
    dt = 1.0 / updated.rate_hz
    fitted = fit_horizon(scale_weights(mpc, before, after), before, after, dt)
    filter_ = fit_noise(estimator, doubt)
    say("margins with the new settings")
    poses = [updated.home, *(np.array(pose) for pose in updated.poses.values())]
    law = task.make("controller", ControllerConfig)
    kept = keep_margins(updated, filter_, (law, fitted), poses)

    def accept(settings: Settings) -> bool:
        """Say whether the margins are kept at all poses."""
        loop = Loop(updated, settings[0], (law, settings[1]))
        return not any(map(loop.judge, kept.poses))

    searched = search((filter_, kept.mpc), twins_of(updated, task, doubt).score, accept, say)
    new = (filter_, searched.mpc)
    shaper = choose_shaper(float(after.f_hz[0]), float(after.zeta[0]), doubt)
    return Proposal(before, after, (estimator, mpc), new, kept, searched, shaper, doubt)


def settings_now(task: Task) -> Mapping[str, Mapping[str, Any]]:
    """Return what a proposal may change as it is now, by section of a moves file and name."""
    sections = {"estimator": task.make("estimator", EstimatorConfig), "mpc": task.make("mpc", MpcConfig)}
    return {
        section: {name: getattr(values, name) for name in RULES if hasattr(values, name)}
        for section, values in sections.items()
    }


def _difference(old: Any, new: Any) -> dict[str, Any]:
    """Return the new values of the fields in which two settings differ."""
    pairs = ((item.name, getattr(old, item.name), getattr(new, item.name)) for item in fields(new))
    return {name: after for name, before, after in pairs if after != before}
