"""The simulated rig: plant and sensors, one control period at a time.

Time is an integer count of ticks; tick k is the instant ``k dt``. Sensors of tick k feel the torque that
acted until then.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.axis_values import check_axis_values
from flexarm_bringup.sim.direct_sensors import DirectSensors
from flexarm_bringup.sim.perturb import PlantSettings
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.sensor_faults import SensorFault, known_faults
from flexarm_bringup.sim.sensor_simulator import SensorSimulator
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.numeric.rotation import rotation_vector
from flexarm_model.settings.parameters import parameter, validate
from flexarm_model.tree.sensors import output_names

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigSettings:
    """Settings of the simulated rig."""

    seed: int = parameter(1, "Seed of all noise.", minimum=0, maximum=2**31)
    noise: float = parameter(
        1.0, "Factor on the noise of every sensor; 0 makes them perfect.", minimum=0.0, maximum=100.0
    )
    frequency_scale: float = parameter(
        1.0, "Real over described natural frequencies.", minimum=0.5, maximum=2.0
    )
    mass_scale: float = parameter(
        1.0, "Real over described point masses of beams.", minimum=0.1, maximum=10.0
    )
    extra_modes: int = parameter(
        3, "Elastic coordinates per body beyond those described.", minimum=0, maximum=10
    )
    friction: float = parameter(0.0, "Coulomb friction of the actuated axes.", "N m", 0.0, 100.0)
    body_mass_scale: float = parameter(
        1.0, "Real over described masses of all bodies.", minimum=0.1, maximum=10.0
    )
    damping_scale: float = parameter(
        1.0, "Real over described damping of bodies that bend and springs.", minimum=0.0, maximum=100.0
    )
    rotor_scale: float = parameter(
        1.0, "Real over described rotor inertias of the actuated axes.", minimum=0.1, maximum=10.0
    )
    backlash: float = parameter(
        0.0, "Total play of every gear beyond that described.", "rad or m", minimum=0.0, maximum=0.1
    )

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ParameterError: A value is outside its range.
        """
        validate(self)

    @property
    def plant(self) -> PlantSettings:
        """What of it concerns the arm and not its sensors."""
        return PlantSettings(**{field.name: getattr(self, field.name) for field in fields(PlantSettings)})


@dataclass(frozen=True)
class Truth:
    """What really happens at a tick; nobody but reports may look at it.

    Attributes:
        theta: Actuated axes [rad or m], (n_theta,).
        theta_dot: Their velocity, (n_theta,).
        tip: Position [m] and rotation vector [rad] of the tip, (6,).
        strain: At every gauge [1], (n_gauges,).
        acceleration: Rows of the accelerometers [m/s^2], (n_acc,).
        rigid_acceleration: What they would feel of a rigid arm moving the same axes [m/s^2], (n_acc,).
    """

    theta: Array
    theta_dot: Array
    tip: Array
    strain: Array
    acceleration: Array
    rigid_acceleration: Array


class Rig:
    """The rig that stands in for hardware; deterministic for a seed.

    Attributes:
        faults: What is wrong with its sensors, by name.
        own_encoders: What faulty encoders would deliver at this tick without their faults: the drives' own.
    """

    def __init__(
        self,
        config: ManipulatorConfig,
        settings: RigSettings | None = None,
        plant: Plant | None = None,
        faults: Mapping[str, SensorFault] | None = None,
    ) -> None:
        """Build the rig at rest at tick 0.

        Args:
            config: The manipulator.
            settings: Noise, perturbation, friction.
            plant: A plant to reuse, compiled already; None builds one from the settings.
            faults: What is wrong with its sensors, by name; nothing with the others.

        Raises:
            ValueError: A fault is of no sensor of the manipulator.
        """
        self.settings = settings or RigSettings()
        self.faults = known_faults(faults or {}, config.sensors)
        self.config, self.tick = config, 0
        self.period_ns = round(1e9 / config.rate_hz)
        self.dt = self.period_ns * 1e-9
        self.plant = plant or Plant(config, self.dt, self.settings.plant)
        self.plant.reset()
        self._axes, self._rows = list(config.actuated), _rows_by_sensor(config)
        self._rows_of = {
            kind: [i for spec in config.sensors if spec.kind == kind for i in self._rows[spec.name]]
            for kind in ("strain_gauge", "accelerometer")
        }
        self._sensors = [self._sensor(spec, self.faults.get(spec.name)) for spec in config.sensors]
        self._direct = DirectSensors(list(takewhile(lambda sensor: sensor.is_direct, self._sensors)))
        self.own_encoders: list[Sample] = []
        self._encoders = [spec for spec in config.sensors if spec.kind == "encoder"]
        self._own: list[SensorSimulator] = []
        self._give_drives_their_own()

    @property
    def hides_encoders(self) -> bool:
        """Whether encoders tell something else than the drives measure."""
        return bool(self._own)

    def set_faults(self, faults: Mapping[str, SensorFault]) -> None:
        """Change what is wrong with the sensors; times of the faults count from now.

        Args:
            faults: By sensor; nothing with the others.

        Raises:
            ValueError: A fault is of no sensor of the manipulator.
        """
        t, known = self.time_of(self.tick), known_faults(faults, self.config.sensors)
        self.faults = {
            name: replace(fault, start=fault.start + t, end=fault.end + t) for name, fault in known.items()
        }
        self._direct.release()
        self._direct = DirectSensors([])
        for sensor in self._sensors:
            sensor.set_fault(self.faults.get(sensor.spec.name))
        self._give_drives_their_own()

    def time_of(self, tick: int, late_ns: int = 0) -> float:
        """Return the instant so long after a tick [s], rounded as a stamp is."""
        return (tick * self.period_ns + late_ns) * 1e-9

    def observe(self) -> list[Sample]:
        """Return what the sensors deliver at the present tick."""
        outputs = self.plant.outputs()
        self.own_encoders = [
            sample for sensor in self._own for sample in sensor.sample(self.tick, self.plant, outputs)
        ]
        samples = self._direct.sample(self.tick, outputs)
        for sensor in self._sensors[len(samples) :]:
            samples += sensor.sample(self.tick, self.plant, outputs)
        return samples

    def step(self, tau: Array) -> list[Sample]:
        """Advance one period under torques ``tau`` [N m] or [N], (n_theta,), and observe.

        Raises:
            ValueError: They are not one finite number per axis; nothing has moved then.
        """
        self.plant.drive(check_axis_values("tau", tau, self._axes))
        self.tick += 1
        return self.observe()

    def rest(self) -> list[Sample]:
        """Let one period pass with the brakes closed and observe."""
        self.tick += 1
        return self.observe()

    def servo(self, acceleration: Array) -> list[Sample]:
        """Advance one period with prescribed accelerations of the actuated axes and observe."""
        self.plant.servo(acceleration)
        self.tick += 1
        return self.observe()

    def truth(self) -> Truth:
        """Return what really happens at the present tick."""
        plant = self.plant
        outputs, T = plant.outputs(), plant.tip_pose()
        return Truth(
            theta=plant.theta.copy(),
            theta_dot=plant.theta_dot.copy(),
            tip=np.concatenate([T[:3, 3], rotation_vector(T[:3, :3])]),
            strain=outputs[self._rows_of["strain_gauge"]],
            acceleration=outputs[self._rows_of["accelerometer"]],
            rigid_acceleration=self._rigid_outputs()[self._rows_of["accelerometer"]],
        )

    def _give_drives_their_own(self) -> None:
        """Let the drives measure for themselves from when an encoder has a fault on."""
        if not self._own and any(spec.name in self.faults for spec in self._encoders):
            self._own = [self._sensor(spec) for spec in self._encoders]

    def _sensor(self, spec: SensorSpec, fault: SensorFault | None = None) -> SensorSimulator:
        settings = self.settings
        return SensorSimulator(spec, self._rows[spec.name], self.dt, settings.seed, settings.noise, fault)

    def _rigid_outputs(self) -> Array:
        plant = self.plant
        q, v, a = (np.zeros(plant.tree.n_q) for _ in range(3))
        for rigid, real in ((q, plant.q), (v, plant.v), (a, plant.a)):
            rigid[plant.tree.actuated] = real[plant.tree.actuated]
        return np.array(plant.tree.functions["outputs"](q, v, a, q))


def _rows_by_sensor(config: ManipulatorConfig) -> dict[str, list[int]]:
    """Return which rows of the outputs each sensor measures."""
    names = output_names(config)
    return {
        spec.name: [i for i, name in enumerate(names) if name.split(".")[0] == spec.name]
        for spec in config.sensors
    }
