"""The rig with its guard in one process, as the nodes are: drives, guard, and the delays between them.

One motor period: the arm moves under the torque chosen before, the sensors speak, and the guard chooses the
next torque from the newest command and from what the drives measured a period ago; that is the newest it has
when it must answer. A command computed from the state of tick k acts from tick k + 1 on, or when it says.
"""

from __future__ import annotations

from collections.abc import Mapping

from flexarm_bringup.sim.drives import Drives
from flexarm_bringup.sim.motor_side import MotorSide
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_controller.due_commands import DueCommands
from flexarm_controller.guard import STOPPED, Guard, GuardCommand, GuardState
from flexarm_controller.guard_settings import GuardSettings, gauges_of, guard_limits, hold_of
from flexarm_controller.guarding.limits import GuardLimits
from flexarm_controller.guarding.pose_loads import PoseLoads
from flexarm_model.manipulator.description import ManipulatorConfig


class Hardware:
    """Rig, drives and guard.

    Attributes:
        is_commanded: The torque that acts from now on is that of a fresh command.
    """

    def __init__(
        self,
        config: ManipulatorConfig,
        simulation: RigSettings | None = None,
        plant: Plant | None = None,
        faults: Mapping[str, SensorFault] | None = None,
        limits: GuardLimits | None = None,
    ) -> None:
        """Build it at rest with the guard stopped.

        Args:
            config: The manipulator.
            simulation: Of the rig.
            plant: A compiled plant to reuse.
            faults: What is wrong with the sensors, by name.
            limits: Of the guard; by itself those that follow from the description.

        Raises:
            ConfigError: A motor cannot hold the weight of the arm everywhere in its range.
        """
        self.drives = Drives(config, simulation, plant, faults)
        tree = self.rig.plant.tree
        settings = GuardSettings()
        self.guard = Guard(limits or guard_limits(config, tree, settings))
        self.drives.tau = list(self.guard.holding)  # the motors bear the arm when the brakes open
        self._loads = PoseLoads(tree, hold_of(self.guard.limits, settings))
        self._gauges = gauges_of(config)
        self._seen = self.drives.state()  # by the guard
        self._commands, self.is_commanded = DueCommands(self.dt), False

    @property
    def rig(self) -> Rig:
        """The arm and its sensors."""
        return self.drives.rig

    @property
    def motors(self) -> MotorSide:
        """What the encoders tell."""
        return self.drives.motors

    @property
    def names(self) -> tuple[str, ...]:
        """Actuated axes."""
        return self.drives.names

    @property
    def tau(self) -> list[float]:
        """Torque that acts from now on, one per axis [N m] or [N]."""
        return self.drives.tau

    @property
    def acted(self) -> list[float]:
        """Torque that acted until now."""
        return self.drives.acted

    @property
    def dt(self) -> float:
        """Motor period [s]."""
        return self.rig.dt

    @property
    def tick(self) -> int:
        """Periods since the start."""
        return self.rig.tick

    @property
    def t(self) -> float:
        """Time since the start [s]."""
        return self.drives.t

    def observe(self) -> list[Sample]:
        """Return what the sensors deliver before anything has moved; call it once, at the start."""
        samples = self._hear_gauges(self.drives.observe())
        self._seen = self._measured()
        return samples

    def advance(self) -> list[Sample]:
        """Move by one period under the torque chosen before; return what the sensors deliver."""
        if self.guard.leaves_drives:
            self.drives.close_brakes()
        elif self.guard.mode != STOPPED and not self.guard.has_given_up:
            self.drives.open_brakes()
        self._seen = self._measured()
        return self._hear_gauges(self.drives.advance())

    def choose_torque(self, command: GuardCommand | None) -> list[float]:
        """Let the guard choose the torque of the period that starts now [N m], (n_theta,)."""
        if command is not None:
            self._commands.add(command)
        passed = self.guard.passed
        self.drives.tau = self.guard.step(self._commands.take(self.t), self._seen, self.t)
        self.is_commanded = self.guard.passed > passed
        loads = self._loads.look(self._seen.position)  # when the answer is out, as the node does
        if loads is not None:
            self.guard.carry(loads)
        return self.drives.tau

    def _measured(self) -> GuardState:
        """Return what drives and gauges measure now."""
        return self.drives.state(self._gauges.read())

    def _hear_gauges(self, samples: list[Sample]) -> list[Sample]:
        self._gauges.begin()
        for sample in samples:
            if sample.kind == "strain_gauge":
                for channel, strain in enumerate(sample.y.tolist()):
                    self._gauges.take(sample.sensor, channel, strain)
        return samples
