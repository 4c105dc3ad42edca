"""Measurement models: what a sensor should say when the state is x, one small object per sensor.

Encoders, strain gauges and accelerometers are rows of the served model and differ in numbers only;
the camera measures a pose. A new kind of sensor is a new class with the same two methods.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.tool.tip import Tip, pose_difference
from flexarm_model.manipulator.sensor_kinds import POSE_CHANNELS, SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace

Array = NDArray[np.float64]
FOLLOWS = 0.1  # of an axis' motion, rad or m; an encoder that moves by less reads what bends under weight


class MeasurementModel(ABC):
    """A sensor as the filter sees it.

    Attributes:
        name: Name of the sensor.
        R: Covariance of its noise, (m, m).
        axes: How it follows the actuated axes where nothing bends, (k, n_theta); rows of zeros, or none, for
            a sensor that does not.
        channels: What it delivers.
    """

    def __init__(self, spec: SensorSpec, axes: Array) -> None:
        """Take the noise from the description."""
        self.name, self.channels, self.axes = spec.name, spec.channels, axes
        self.R = np.diag(np.asarray(spec.sigma, dtype=np.float64) ** 2)

    @property
    def locates(self) -> bool:
        """It tells where an actuated axis is, without integrating."""
        return bool(self.axes.any())

    @abstractmethod
    def innovation(self, y: Array, x: Array, u: Array) -> Array:
        """Return measured minus predicted, (m,); ``u = [tau; 1]`` is the torque of that instant."""

    @abstractmethod
    def jacobian(self, x: Array) -> Array:
        """Return the derivative of the prediction by the state, (m, n_x)."""

    def noise(self, force_cov: Array) -> Array:
        """Return the covariance of a sample with the force noise (n, n) that it feels, (m, m)."""
        return self.R

    def linearise(self, y: Array, x: Array, u: Array) -> tuple[Array, Array]:
        """Return innovation (m,) and Jacobian (m, n_x); a class may do it cheaper than one by one."""
        return self.innovation(y, x, u), self.jacobian(x)


class LinearRows(MeasurementModel):
    """Rows of the served model: ``y = C x + D [tau; 1] + sum p_i C_i x + D_w f + v``.

    Attributes:
        C: (m, n_x).
        D: Feed-through of the torque and constant output, (m, n_u + 1).
        D_w: Feed-through of force noise, (m, n).
        slopes: C_i of every learned parameter, (m, n_x) each.
        kept: Where its rows stand among those of ``whole``.
    """

    def __init__(self, spec: SensorSpec, model: ReducedModel, system: StateSpace) -> None:
        """Pick the rows "sensor.channel" in the order of the sensor's channels.

        Raises:
            KeyError: The model has no such row; the message lists those that exist.
        """
        rows = _rows(spec, model)
        by_axes = model.outputs.C_pos[rows, : model.n_theta]
        follows = SENSOR_KINDS[spec.kind].locates * (abs(by_axes) > FOLLOWS)
        super().__init__(spec, by_axes * follows)
        self.C = system.C[rows]
        self.D = np.column_stack([system.D[rows], system.y_c[rows]])
        self.D_w = system.D_w[rows]
        self.slopes = tuple(self.D_w @ force for force in system.learned)
        self._whole = None if spec.mounted is None else LinearRows(spec.mounted, model, system)
        self.kept = [self.whole.channels.index(channel) for channel in spec.channels]

    @property
    def whole(self) -> LinearRows:
        """The same with the channels that are switched off."""
        return self._whole or self

    def innovation(self, y: Array, x: Array, u: Array) -> Array:
        """Return ``y - C x - D u - sum p_i C_i x``, (m,)."""
        nu: Array = y - self.C.dot(x) - self.D.dot(u)
        for i, slope in enumerate(self.slopes, x.size - len(self.slopes)):
            nu -= float(x[i]) * slope.dot(x)
        return nu

    def jacobian(self, x: Array) -> Array:
        """Return C, constant but for what is learned, (m, n_x)."""
        C = self.C.copy() if self.slopes else self.C
        for i, slope in enumerate(self.slopes, x.size - len(self.slopes)):
            C += float(x[i]) * slope
            C[:, i] += slope.dot(x)
        return C

    def noise(self, force_cov: Array) -> Array:
        """Return ``R + D_w F D_w'``, (m, m)."""
        return np.asarray(self.R + self.D_w.dot(force_cov).dot(self.D_w.T))


class TipPose(MeasurementModel):
    """Pose of the tip seen by a camera: y = [position; rotation vector], or the channels of it that it sees.

    Innovation ``[p - p(x); log(R R(x)')]``; its Jacobian is exact where the innovation is zero, and
    of first order in it elsewhere.
    """

    def __init__(self, spec: SensorSpec, tip: Tip, n_x: int, n_theta: int) -> None:
        """Bind the sensor to the kinematics of the tip, which all axes are taken to move."""
        super().__init__(spec, np.eye(n_theta))
        self._tip, self._H = tip, np.zeros((len(spec.channels), n_x))
        self._rows = [POSE_CHANNELS.index(channel) for channel in spec.channels]
        self._is_whole = len(self._rows) == len(POSE_CHANNELS)

    def innovation(self, y: Array, x: Array, u: Array) -> Array:
        """Return position [m] and rotation [rad] from the predicted to the measured pose, (m,)."""
        return self._seen(pose_difference(self._pose(y), self._tip.pose(x)))

    def jacobian(self, x: Array) -> Array:
        """Return the tip's Jacobian in world axes, zero for velocities and disturbance, (m, n_x)."""
        return self._pad(self._tip.locate(x)[1])

    def linearise(self, y: Array, x: Array, u: Array) -> tuple[Array, Array]:
        """Return innovation (m,) and Jacobian (m, n_x)."""
        nu, J = self._tip.compare(self._pose(y), x)
        return self._seen(nu), self._pad(J)

    def _pose(self, y: Array) -> Array:
        """Return a sample as a pose (6,); what is not seen is zero."""
        if self._is_whole:
            return y
        pose = np.zeros(len(POSE_CHANNELS))
        pose[self._rows] = y
        return pose

    def _seen(self, rows: Array) -> Array:
        """Return the rows (6, ...) that are seen."""
        return rows if self._is_whole else rows[self._rows]

    def _pad(self, J: Array) -> Array:
        H = self._H.copy()
        H[:, : J.shape[1]] = self._seen(J)
        return H


@dataclass(frozen=True)
class SensorModels:
    """All sensors, those with constant rows apart (they can be stacked)."""

    rows: dict[str, LinearRows]
    poses: dict[str, MeasurementModel]

    def all(self) -> dict[str, MeasurementModel]:
        """Return every sensor by name."""
        return {**self.rows, **self.poses}


def build_sensor_models(
    specs: tuple[SensorSpec, ...], model: ReducedModel, system: StateSpace, tip: Tip
) -> SensorModels:
    """Make the measurement model of every sensor, in the given order.

    Raises:
        KeyError: The served model lacks rows of a sensor.
    """
    poses = {s.name: TipPose(s, tip, system.n_x, model.n_theta) for s in specs if s.kind in _POSE_KINDS}
    rows = {s.name: LinearRows(s, model, system) for s in specs if s.kind not in _POSE_KINDS}
    return SensorModels(rows, dict(poses))


_POSE_KINDS = ("camera",)


def _rows(spec: SensorSpec, model: ReducedModel) -> list[int]:
    known = model.outputs.rows(spec.name)
    by_name = {model.outputs.names[i]: i for i in known}
    wanted = [f"{spec.name}.{channel}" for channel in spec.channels]
    missing = [name for name in wanted if name not in by_name]
    if missing:
        raise KeyError(f"no output row {', '.join(missing)}; known: {', '.join(by_name)}")
    return [by_name[name] for name in wanted]
