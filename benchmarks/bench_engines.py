"""Simulated seconds per second on the single link, beside EXUDYN and MuJoCo at equal tip accuracy.

A constant torque swings the geared arm by more than a radian and makes it ring. Every engine climbs a ladder
of finer settings; counted is the first whose tip stays within ``TOLERANCE`` of EXUDYN's finest run. EXUDYN
models the strip with ANCF cable elements, MuJoCo with rigid segments and springs at their centres, we with
the compiled reduced tree. CPU time of the process; building and compiling are not counted.

The two engines are needed here only: ``./flexarm bench`` brings them (``requirements.bench.lock``).
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bench import load_module
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.numeric.compiled import compile_functions
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.segments.segments import cut_beam
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

DURATION, SAMPLE = 1.0, 0.01  # s
TORQUE = 1.0  # N m
TOLERANCE = 2e-5  # m
SAMPLES = round(DURATION / SAMPLE)
EXUDYN_ARM = load_module(Path(__file__).with_name("exudyn_arm.py"))


@dataclass(frozen=True)
class Run:
    """One simulation.

    Attributes:
        setting: What was set.
        tip: Position of the tip at every sample [m], (SAMPLES, 2).
        seconds: CPU time [s].
    """

    setting: str
    tip: Array
    seconds: float


def the_arm() -> tuple[ManipulatorConfig, Beam, float, float]:
    """Return the description without damping, its strip, hub inertia [kg m^2] and clamp radius [m]."""
    config = load_config(find_manipulator("single_link"), "geared")
    strip = config.bodies["strip"]
    assert isinstance(strip, Beam)
    strip = replace(strip, damping_ratio=0.0)
    clamp = next(joint for joint in config.joints if joint.name == "clamp")
    (axis,) = config.actuated.values()
    bodies = {**config.bodies, "strip": strip}
    return replace(config, bodies=bodies), strip, axis.rotor_inertia, float(clamp.placement[0, 3])


def run_ours(modes: int, step: float) -> Run:
    """Simulate with the compiled reduced tree: classical Runge-Kutta, rolled out in C."""
    config, strip, _, _ = the_arm()
    strip = replace(strip, reduction=replace(strip.reduction, modes=modes))
    tree = ReducedTree(replace(config, bodies={**config.bodies, "strip": strip}))
    n = tree.n_q
    q, v, tau = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("tau")
    force = ca.SX.zeros(n)
    force[tree.actuated[0]] = tau
    rate = ca.Function("rate", [q, v, tau], [tree.expressions["forward_dynamics"](q, v, force)])
    x, u = ca.MX.sym("x", 2 * n), ca.MX.sym("u")

    def slope(at: ca.MX) -> ca.MX:
        return ca.vertcat(at[n:], rate(at[:n], at[n:], u))

    k1 = slope(x)
    k2 = slope(x + step / 2 * k1)
    k3 = slope(x + step / 2 * k2)
    k4 = slope(x + step * k3)
    one = ca.Function("one", [x, u], [x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    per_sample = round(SAMPLE / step)
    many = one.mapaccum(per_sample * SAMPLES)
    rollout = compile_functions({"rollout": ca.Function("rollout", [x, u], [many(x, u)])})["rollout"]
    start = time.process_time()
    states = rollout(np.zeros(2 * n), TORQUE)[:, per_sample - 1 :: per_sample]
    seconds = time.process_time() - start
    tip = np.array([tree.tip_pose(state[:n])[:2, 3] for state in states.T])
    return Run(f"{modes} modes, {1e3 * step:g} ms", tip, seconds)


def run_exudyn(elements: int, step: float) -> Run:
    """Simulate with ANCF cable elements and the generalised-alpha method."""
    _, strip, inertia, radius = the_arm()
    system, sensor = EXUDYN_ARM.build(strip, inertia, radius, elements, TORQUE)
    seconds = EXUDYN_ARM.solve(system, step, DURATION, SAMPLE)
    tip = np.array(system.GetSensorStoredData(sensor))[-SAMPLES:, 1:3]
    return Run(f"{elements} ANCF elements, {1e3 * step:g} ms", tip, seconds)


def run_mujoco(segments: int, step: float) -> Run:
    """Simulate with rigid segments joined by springs at the segment centres, classical Runge-Kutta."""
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(_mujoco_arm(segments, step))
    data = mujoco.MjData(model)
    data.ctrl[0] = TORQUE
    per_sample, tip = round(SAMPLE / step), np.zeros((SAMPLES, 2))
    start = time.process_time()
    for i in range(SAMPLES):
        mujoco.mj_step(model, data, per_sample)
        mujoco.mj_kinematics(model, data)
        tip[i] = data.site_xpos[0, :2]
    return Run(f"{segments} segments, {1e3 * step:g} ms", tip, time.process_time() - start)


def _mujoco_arm(segments: int, step: float) -> str:
    _, strip, inertia, radius = the_arm()
    opened, at = "", radius
    pieces = cut_beam(strip, segments)
    for piece in pieces:
        joint = "".join(
            f'<joint type="hinge" axis="0 0 1" stiffness="{float(k)!r}"/>' for _, _, k in piece.springs
        )
        moments = " ".join(repr(max(float(value), 1e-9)) for value in np.diag(piece.inertia))
        place = f'pos="{float(piece.com[0])!r} 0 0" mass="{float(piece.mass)!r}"'
        body = f'<inertial {place} diaginertia="{moments}"/>'
        opened += f'<body pos="{float(at)!r} 0 0">{joint}{body}'
        at = piece.to_next
    site = f'<site pos="{float(at)!r} 0 0"/>'
    hub = f'<joint name="axis" type="hinge" axis="0 0 1" armature="{inertia!r}"/>'
    return f"""<mujoco><compiler balanceinertia="true"/>
<option timestep="{step!r}" gravity="0 0 0" integrator="RK4"/>
<worldbody><body>{hub}<inertial pos="0 0 0" mass="1e-3" diaginertia="1e-9 1e-9 1e-9"/>
{opened}{site}{"</body>" * len(pieces)}</body></worldbody>
<actuator><motor joint="axis"/></actuator></mujoco>"""


LADDERS: dict[str, tuple[Callable[..., Run], list[tuple[Any, ...]]]] = {
    "ours": (run_ours, [(1, 5e-3), (2, 2.5e-3), (3, 1e-3), (4, 5e-4), (6, 2e-4)]),
    "exudyn": (run_exudyn, [(2, 5e-3), (2, 2e-3), (4, 2e-3), (4, 1e-3), (8, 1e-3), (16, 5e-4)]),
    "mujoco": (
        run_mujoco,
        [(8, 2e-4), (8, 1e-4), (12, 1e-4), (16, 5e-5), (24, 5e-5), (32, 2.5e-5)],  # stable from here on
    ),
}
FINEST = (32, 1e-4)  # EXUDYN


def climb(engine: str, reference: Array) -> Iterator[tuple[Run, float]]:
    """Yield the runs of an engine with their largest tip error [m], up to the first that is good."""
    run, settings = LADDERS[engine]
    for setting in settings:
        done = min((run(*setting) for _ in range(3)), key=lambda each: each.seconds)
        error = float(abs(done.tip - reference).max()) if np.isfinite(done.tip).all() else np.inf
        yield done, error
        if error <= TOLERANCE:
            return


def main() -> dict[str, float]:
    """Return simulated seconds per second and tip errors [um]; ours alone where an engine is missing."""
    missing = [name for name in ("exudyn", "mujoco") if importlib.util.find_spec(name) is None]
    if missing:
        print(f"not installed: {', '.join(missing)}; pip install --require-hashes -r requirements.bench.lock")
        return {f"seconds_per_s_ours_{modes}_modes": 1 / run_ours(modes, 1e-3).seconds for modes in (2, 3)}
    reference = run_exudyn(*FINEST).tip
    results: dict[str, float] = {}
    for engine in LADDERS:
        *_, (run, error) = climb(engine, reference)
        print(f"{engine}: {run.setting}: {1e3 * run.seconds:.3g} ms, tip within {1e6 * error:.3g} um")
        results[f"{engine}_simulated_s_per_s"] = DURATION / run.seconds
        results[f"{engine}_tip_error_um"] = 1e6 * error
    for engine in ("exudyn", "mujoco"):
        ratio = results["ours_simulated_s_per_s"] / results[f"{engine}_simulated_s_per_s"]
        results[f"ours_times_{engine}"] = ratio
    return results


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:32} {value:12.4g}")
