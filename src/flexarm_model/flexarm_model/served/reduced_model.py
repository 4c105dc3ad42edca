"""The served form: a linear reduced model of the arm about one pose.

With ``xi = [theta; eta]`` (actuated axes; elastic modes with those axes locked)::

    M xi'' + D xi' + K (xi - [pose; 0]) = B tau - f0
    y = y0 + C_pos (xi - [pose; 0]) + C_vel xi' + C_acc xi''

It has the same shape for every manipulator; estimator and controller know nothing else
of the dynamics. ``model_id`` is the hash of its content.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outputs:
    """Linear output rows, sensors first and the tool's six rows last.

    Attributes:
        names: ``sensor.channel`` of every row, (n_y,).
        units: SI unit of every row, (n_y,).
        y0: Outputs at rest at the operating point, (n_y,).
        C_pos: Row per output, column per coordinate, (n_y, n).
        C_vel: The same for velocities, (n_y, n).
        C_acc: The same for accelerations, (n_y, n).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    y0: Array
    C_pos: Array
    C_vel: Array
    C_acc: Array

    def rows(self, sensor: str) -> list[int]:
        """Return the indices of the rows that belong to ``sensor`` ("root_strain", "tip").

        Raises:
            KeyError: No row has that sensor; the message lists those that exist.
        """
        if sensor not in self._by_sensor:
            known = ", ".join(sorted(self._by_sensor))
            raise KeyError(f"sensor '{sensor}' has no output row; known: {known}")
        return self._by_sensor[sensor].copy()

    @property
    def sensors(self) -> Collection[str]:
        """Names of the sensors that have rows, and "tip"."""
        return self._by_sensor.keys()

    @cached_property
    def _by_sensor(self) -> dict[str, list[int]]:
        """Indices of the rows of every sensor."""
        found: dict[str, list[int]] = {}
        for i, name in enumerate(self.names):
            found.setdefault(name.split(".")[0], []).append(i)
        return found


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """Linear reduced model about one pose; see the module for the equations.

    Two models are equal when every field is, bit for bit.

    Attributes:
        manipulator: Name of the manipulator.
        config_id: Content hash of its description.
        theta_names: Actuated axes, "joint.axis", (n_theta,).
        pose: Operating point of the actuated axes [rad or m], (n_theta,).
        M: Mass, identity on the modes [kg m^2, kg, 1], (n, n).
        D: Damping; ``2 zeta omega`` on the modes, (n, n).
        K: Stiffness; ``omega^2`` on the modes, (n, n).
        B: Input, (n, n_theta).
        f0: Static force at the operating point, (n,).
        omega: Frequencies of the locked modes, ascending [rad/s], (n_eta,).
        zeta: Their damping ratios [1], (n_eta,).
        outputs: Rows of y.
        q0: Tree coordinates at the operating point, (n_q,).
        Phi: ``q = q0 + Phi (xi - [pose; 0])``, (n_q, n).
    """

    manipulator: str
    config_id: str
    theta_names: tuple[str, ...]
    pose: Array
    M: Array
    D: Array
    K: Array
    B: Array
    f0: Array
    omega: Array
    zeta: Array
    outputs: Outputs
    q0: Array
    Phi: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only; the caller's own are copied."""
        lock_arrays(self)
        lock_arrays(self.outputs)

    def __eq__(self, other: object) -> bool:
        """Compare contents; arrays have no single truth that fields could be compared by."""
        return self.model_id == other.model_id if isinstance(other, ReducedModel) else NotImplemented

    def __hash__(self) -> int:
        """Return a hash of the content."""
        return hash(self.model_id)

    @property
    def n_theta(self) -> int:
        """Number of actuated axes."""
        return len(self.theta_names)

    @property
    def n_eta(self) -> int:
        """Number of elastic modes."""
        return int(self.omega.size)

    @property
    def n(self) -> int:
        """Number of served coordinates."""
        return self.n_theta + self.n_eta

    @property
    def eta_names(self) -> tuple[str, ...]:
        """Names of the modes, slowest first."""
        return tuple(f"mode_{i + 1}" for i in range(self.n_eta))

    @cached_property
    def xi0(self) -> Array:
        """Coordinates of the operating point ``[pose; 0]``, (n,)."""
        return np.concatenate([self.pose, np.zeros(self.n_eta)])

    @cached_property
    def model_id(self) -> str:
        """Content hash: 16 hexadecimal digits, equal when every field is equal bit for bit."""
        digest = hashlib.sha256()
        for holder in (self, self.outputs):
            for field in fields(holder):
                value = getattr(holder, field.name)
                if isinstance(value, np.ndarray):
                    digest.update(repr(value.shape).encode() + np.ascontiguousarray(value).tobytes())
                elif not isinstance(value, Outputs):
                    digest.update(repr(value).encode())
        return digest.hexdigest()[:16]
