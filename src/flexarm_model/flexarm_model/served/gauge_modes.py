"""Gauges whose strain the kept modes of their beam tell wrongly.

Few modes of a beam may give all frequencies of an arm and still bend otherwise between the nodes that joints
use, where weight and inertia act and no static shape is kept: elements, however many, do not help. So the arm
is reduced once more, with some modes more in every beam that bears a gauge, and the same is asked of both:
the strain at rest, and that of every served mode at the same energy, ``|C_pos_k| / omega_k``. Modes of nearly
one frequency may be any mixture, so they count together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.beam_superelement import count_modes, count_static
from flexarm_model.bodies.few_modes import joined_nodes
from flexarm_model.manipulator.body_spec import Beam, Reduction
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
MORE = 6  # modes of a beam
HIGHER = 4.0  # times the frequency up to which a beam keeps its modes, where that is what it says
TOGETHER = 0.02  # of a frequency, up to the next one
OF_LARGEST = 0.1  # of the largest strain that a mode makes at a gauge
OF_STATIC = 0.05  # of the strain at rest, beside the noise of a sample
MICRO, PERCENT = 1e6, 100.0


def describe_gauge_modes(config: ManipulatorConfig, model: ReducedModel) -> tuple[str, ...]:
    """Return a sentence that names gauges whose beam keeps too few modes for them; none if there is none.

    Args:
        config: The arm.
        model: Served of it, anywhere.
    """
    gauges = [spec for spec in config.sensors if spec.kind == "strain_gauge"]
    finer = with_more_modes(config, {spec.site.partition(".")[0] for spec in gauges})
    try:
        exact = linearize(ReducedTree(finer, use_compiler=False), model.pose, model.n_eta)
    except PoseError:  # what bends too far with more modes is told elsewhere
        return ()
    found = [text for spec in gauges if (text := _judge(spec, config, model, exact))]
    if not found:
        return ()
    return (
        "the modes that a beam keeps tell the strain at a gauge wrongly, and the estimator would believe it: "
        f"{'; '.join(found)}; expected more reduction.modes there, until this is no longer said",
    )


def with_more_modes(config: ManipulatorConfig, bodies: set[str]) -> ManipulatorConfig:
    """Return the arm with some modes more in those of the bodies that are beams, as far as these have any."""
    new = dict(config.bodies)
    for name in bodies:
        if isinstance(beam := new[name], Beam):
            new[name] = replace(beam, reduction=_finer(beam, joined_nodes(config, name)))
    return replace(config, bodies=new)


def _finer(beam: Beam, joined: set[str]) -> Reduction:
    kept, most = beam.reduction, count_modes(beam, joined)
    if kept.f_max and not kept.modes:
        return replace(kept, method="craig_bampton", f_max=HIGHER * kept.f_max)
    wanted = min((kept.modes or count_static(beam, joined)) + MORE, most)
    return replace(kept, method="craig_bampton", modes=wanted, f_max=0.0)


def _judge(spec: SensorSpec, config: ManipulatorConfig, model: ReducedModel, exact: ReducedModel) -> str:
    """Return what is to be said of a gauge; empty where both agree."""
    (row,) = model.outputs.rows(spec.name)
    rest, right = (float(each.outputs.y0[row]) for each in (model, exact))
    kept, told = config.bodies[spec.site.partition(".")[0]], ""
    if abs(rest - right) > spec.sigma[0] + OF_STATIC * abs(right):
        told = f"{MICRO * rest:.1f} ustrain at rest for {MICRO * right:.1f}"
    groups = np.flatnonzero(np.diff(exact.omega) > TOGETHER * exact.omega[:-1]) + 1
    found, wanted = (_strains(each, row, groups) for each in (model, exact))
    off = abs(found - wanted) / max(wanted.max(initial=0.0), np.finfo(float).tiny)
    if off.max(initial=0.0) > OF_LARGEST:
        mode = 1 + int(np.append(0, groups)[off.argmax()])
        told += f"{', ' if told else ''}mode {mode} off by {PERCENT * off.max():.0f} % of the largest"
    modes = kept.reduction.modes if isinstance(kept, Beam) else 0
    return told and f"{spec.name} {told} (has {modes or 'the static ones only'})"


def _strains(model: ReducedModel, row: int, groups: NDArray[np.intp]) -> Array:
    """Return the strain that modes make at one energy, those of nearly one frequency together, (k,)."""
    strain = model.outputs.C_pos[row, model.n_theta :] / model.omega
    return np.array([np.linalg.norm(part) for part in np.split(strain, groups)])
