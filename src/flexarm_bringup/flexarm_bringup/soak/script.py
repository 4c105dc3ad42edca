"""What happens in a soak, drawn at random: moves, faults of sensors, processes killed."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.sensor_fault_text import faults_text
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_controller.reference import Reference
from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.motion.profiles import Quintic

Array = NDArray[np.float64]

VICTIMS = ("estimator", "controller", "model")  # killed and started again; guard and rig stay
STRIDE = {"t": 0.04, "r": math.radians(50.0)}  # from home, where no poses are named [m or rad]
SHARE = 0.5  # of an axis' range, velocity and acceleration that a move uses at most
MOVE_TIME = (1.0, 2.0)  # s
FAULT_TIME = (0.5, 3.0)  # s
GRID = 0.01  # s between points of the reference
PEAK_RATE = 1.875  # of a quintic of unit size and duration
FAULTS: dict[str, Callable[[SensorSpec], dict[str, Any]]] = {
    "off": lambda spec: {},
    "stuck": lambda spec: {},
    "garbage": lambda spec: {"share": 0.05},
    "wrong": lambda spec: {"factor": -1.0},
    "slow": lambda spec: {"rate_hz": 20.0},
    "delayed": lambda spec: {"delay": 0.04, "jitter": 0.02},
    "intermittent": lambda spec: {"period": 0.4, "share": 0.5},
    "bias": lambda spec: {"bias": 20.0 * float(spec.sigma[0])},
    "nan": lambda spec: {"share": 0.3},
}


def random_goal(rng: np.random.Generator, config: ManipulatorConfig) -> Array:
    """Return a pose to move to: between home and a named pose, or around home, (n_theta,)."""
    home, poses = np.array(config.home), list(config.poses.values())
    if poses:
        return np.asarray(home + rng.uniform(0.0, 1.0) * (poses[rng.integers(len(poses))] - home))
    reach = np.array([_reach(name, axis) for name, axis in config.actuated.items()])
    return np.asarray(home + rng.uniform(-1.0, 1.0, home.size) * reach)


def move(rng: np.random.Generator, start: Array, goal: Array, config: ManipulatorConfig) -> Reference:
    """Return a rest-to-rest move from time zero on.

    Args:
        rng: Chooses how long it takes.
        start: Actuated axes before it [rad or m], (n_theta,).
        goal: And after it.
        config: For the velocities that the axes may have.
    """
    limits = np.array([SHARE * axis.velocity for axis in config.actuated.values()])
    duration = max(rng.uniform(*MOVE_TIME), float((PEAK_RATE * abs(goal - start) / limits).max(initial=0.0)))
    times: Array = np.arange(math.ceil(duration / GRID) + 2, dtype=np.float64) * GRID
    s, rate, acceleration = (np.asarray(part)[:, None] for part in Quintic(1.0, duration).sample(times))
    way = goal - start
    return Reference(times, start + s * way, rate * way, acceleration * way)


def random_fault(rng: np.random.Generator, sensors: Sequence[SensorSpec]) -> str:
    """Return a fault of one sensor as text, from now on for some seconds."""
    spec = sensors[int(rng.integers(len(sensors)))]
    kind = list(FAULTS)[int(rng.integers(len(FAULTS)))]
    end = float(np.round(rng.uniform(*FAULT_TIME), 2))
    return faults_text({spec.name: SensorFault(kind, end=end, **FAULTS[kind](spec))}, sensors)


class Script:
    """When what happens; every stretch between two events of a kind is drawn from an exponential.

    Attributes:
        rng: Where all chance comes from.
    """

    def __init__(self, seed: int, fault_every: float, kill_every: float) -> None:
        """Begin at time zero; means between faults and between kills [s], 0 for never."""
        self.rng = np.random.default_rng(seed)
        self._means = {"fault": fault_every or math.inf, "kill": kill_every or math.inf}
        self._next = {name: self._draw(mean) for name, mean in self._means.items()}

    def due(self, t: float) -> list[str]:
        """Return what happens now, "fault" or "kill"; a stretch begins when its event has happened."""
        found = [name for name, at in self._next.items() if t >= at]
        self._next |= {name: t + self._draw(self._means[name]) for name in found}
        return found

    def victim(self) -> str:
        """Return the process to kill."""
        return VICTIMS[self.rng.integers(len(VICTIMS))]

    def _draw(self, mean: float) -> float:
        """Return a stretch [s]: never shorter than half its mean, so that restarts come to their end."""
        return mean if math.isinf(mean) else mean * (0.5 + self.rng.exponential(0.5))


def _reach(name: str, axis: Axis) -> float:
    stride = STRIDE[name.rpartition(".")[2][0]]
    return min(stride, SHARE * (axis.upper - axis.lower) / 2.0)
