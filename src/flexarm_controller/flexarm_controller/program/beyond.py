"""What the served model does not know of the reference: products of velocities, and another inertia.

A filter that knows the arm's own motion takes what a linear model leaves out of it from the unmodelled torque
``d``, and then nobody predicts it. Along the reference it is known before the motion begins,

    w(t) = U_v theta' + U_a theta'' - D(theta) theta' - J(theta) theta'' - sum turning_jk theta_j' theta_k'

with U of ``equilibrium`` and the rest of ``Way``, the arm as described: it needs more than the model says by
``-w``. With ``u' = u + w`` it is the served one again, ``x <- A x + B (u' + d) + c``: the program plans u',
of which w is taken off again. Limits of the torque and of its rate are those of u, so the rows of u' move by
w. Between two instants of the grid w is held at what it is in the middle, as torques are held.

The same forces bend the links, by ``b(t)`` farther than X of ``equilibrium`` says. That is no vibration: the
program counts the modes from there, ``eta' = eta - b``, which move as the served model says where b changes
slowly beside them, as X has it too. Limited gauges read the whole of it, so their rows move by ``-C b``.

What weight and springs ask is left to the served models: at rest w and b are zero, whatever they are made
of, and the arm stands where it shall.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.motion.pose_load import PoseLoad
from flexarm_controller.motion.way import Way
from flexarm_controller.program.delay import split_delay, torques_kept
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.program.preview import SAME_INSTANT, WINDOWS
from flexarm_controller.program.soft_outputs import build_soft_outputs
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
FINE = 0.25  # rad, of all axes together, from pose to pose
BESIDE = 0.2  # rad from a way, of each axis: inertia changes by so little


class Beyond(NamedTuple):
    """Torque w [N m] or [N] and bend b of one step.

    Attributes:
        sent: w in the periods of the torques sent, oldest first, (kept, n_u).
        planned: In those of the horizon, (N, n_u).
        bends: b of the state, and where the first torque planned begins and ends, (3, n_eta).
        rows: By how much the rows move: of torques and rates, then of limited outputs with an upper and again
            with a lower bound, in units of the limits, (2 n_v + 2 n_b n_s,).
    """

    sent: Array
    planned: Array
    bends: Array
    rows: Array


class ArmAhead:
    """The loads of an arm along what it follows, made one pose after the other while there is time.

    They are used from so many steps on as there are poses, whether they were made between the steps or not,
    so a replay has them when the rig had them. Until then those of the way before stay, of which the nearest
    pose counts.
    """

    def __init__(self, loads: ArmLoads) -> None:
        """Take the loads of the arm wherever its axes are."""
        self._loads = loads
        self._reference: Reference | None = None
        self._way: Way | None = None
        self._left: list[Array] = []
        self._made: list[PoseLoad] = []
        self._steps = 0  # until they are used

    def expect(self, reference: Reference | None) -> None:
        """Look along what is to be followed from now on."""
        self._reference, self._left, self._made, self._steps = reference, [], [], 0
        if reference is not None and self._loads.changes:
            poses, _ = self._loads.poses_along(reference, FINE)
            self._left, self._steps = [*poses], len(poses)

    def modes_of(self, model: ReducedModel) -> Array:
        """Return what the modes of a model are in the coordinates of the arm, (n_eta, n_q)."""
        return self._loads.modes_of(model)

    def work_ahead(self) -> None:
        """Make the loads of one pose."""
        if self._left and (load := self._loads.of_motors(self._left.pop(0))) is not None:
            self._made.append(load)

    def step(self, reference: Reference) -> Way | None:
        """Return the loads along a reference, to be asked once a step; None: as if none changed.

        One that nobody expected has those of the way before where it goes beside that.
        """
        if reference is not self._reference and not self._steps:
            is_beside = self._way is not None and self._way.is_near(reference.theta, BESIDE)
            self._reference, self._way = reference, self._way if is_beside else None
        if self._steps:
            self._steps -= 1
            if not self._steps:
                self._finish()
        return self._way

    def _finish(self) -> None:
        while self._left:
            self.work_ahead()
        self._way, self._made = Way(self._made, self._loads.size) if self._made else None, []


@dataclass(frozen=True)
class _Grid:
    """Periods that a step looks at.

    Attributes:
        kept, horizon: Torques sent, and planned.
        begins, ends: First period of every block, and the one after its last, of those planned, (n_b,).
        lead: From the instant of a state to the begin of the first period planned [s].
        dt: [s].
    """

    kept: int
    horizon: int
    begins: NDArray[np.intp]
    ends: NDArray[np.intp]
    lead: float
    dt: float


class TorqueBeyond:
    """What one model does not know of the torque along a reference, and of what it bends."""

    def __init__(
        self, model: ReducedModel, ahead: ArmAhead, limits: Limits, config: MpcConfig, dt: float
    ) -> None:
        """Prepare for control period ``dt`` [s].

        Args:
            model: As described.
            ahead: The arm.
            limits: Of torques and outputs.
            config: Horizon, blocks, delay.
            dt: Control period [s].
        """
        (whole, share), n = split_delay(config, dt), model.n_theta
        ends: NDArray[np.intp] = np.cumsum(config.blocks, dtype=np.intp)
        lead, kept = (whole + share) * dt, torques_kept(config, dt)
        self._grid = _Grid(kept, config.horizon, ends - config.blocks, ends, lead, dt)
        rest, self._effort, self._ahead = build_equilibrium(model), limits.effort, ahead
        self._U, self._X = rest.U[:, n:], rest.X[n : model.n, n:]
        self._limited = build_soft_outputs(model, limits, config).C[:, n : model.n]
        self._modes = ahead.modes_of(model)
        self._of: tuple[Reference, Way] | None = None
        self._start = 0.0
        self._windows: list[Beyond] = []

    def look(self, reference: Reference, t: float) -> Beyond | None:
        """Return the torque for a state at ``t`` [s]; None where the model knows all of it. Read-only."""
        way, dt = self._ahead.step(reference), self._grid.dt
        if way is None:
            self._of = None
            return None
        periods = (t - self._start) / dt
        window = round(periods) if 0.0 <= periods + 0.5 < WINDOWS else -1  # also where t is no number
        is_known = self._of is not None and reference is self._of[0] and way is self._of[1] and window >= 0
        if not is_known or abs(t - self._start - window * dt) > SAME_INSTANT:
            self._of, self._start, window = (reference, way), t, 0
            self._windows = self._work_out(way, reference, t)
        return self._windows[window]

    def work_ahead(self) -> None:
        """Do what has time until the next step."""
        self._ahead.work_ahead()

    def _work_out(self, way: Way, reference: Reference, t: float) -> list[Beyond]:
        """Return it for this period and the next ones."""
        grid, dt = self._grid, self._grid.dt
        count, begin = grid.kept + grid.horizon, t + grid.lead
        middles = begin + (np.arange(count + WINDOWS - 1.0) - grid.kept + 0.5) * dt
        w = self._torque(way, reference.stacked(middles))
        instants = np.append(t + np.arange(WINDOWS) * dt, begin + np.arange(grid.horizon + WINDOWS) * dt)
        measured, bends = np.split(self._bend(way, reference.stacked(instants)), [WINDOWS])
        w.flags.writeable = bends.flags.writeable = False
        return [
            self._window(w[k : k + count], measured[k], bends[k : k + grid.horizon + 1])
            for k in range(WINDOWS)
        ]

    def _torque(self, way: Way, samples: Array) -> Array:
        """Return w at samples of a reference (k, 3 n_u), (k, n_u)."""
        n = self._effort.size
        theta, theta_dot, theta_ddot = (samples[:, i * n : (i + 1) * n] for i in range(3))
        arm = way.viscous(theta, theta_dot) + way.turning(theta, theta_dot) + way.inertia(theta, theta_ddot)
        return np.asarray(samples[:, n:] @ self._U.T - arm[:, :n])

    def _bend(self, way: Way, samples: Array) -> Array:
        """Return b at samples of a reference (k, 3 n_u), (k, n_eta)."""
        bending = way.bending(self._modes, *np.split(samples, 3, axis=1))
        return np.asarray(bending - samples[:, self._effort.size :] @ self._X.T)

    def _window(self, w: Array, measured: Array, bends: Array) -> Beyond:
        """Return one step's: w of its periods, b with its state and from its first torque on."""
        grid = self._grid
        sent, planned = w[: grid.kept], w[grid.kept :]
        held = planned[grid.begins] / self._effort
        rates = np.diff(np.vstack([sent[-1] / self._effort, held]), axis=0)
        limited = -(bends[grid.ends] @ self._limited.T).ravel()
        rows = np.concatenate([held.ravel(), rates.ravel(), limited, limited])
        return Beyond(sent, planned, np.stack([measured, *bends[:2]]), rows)
