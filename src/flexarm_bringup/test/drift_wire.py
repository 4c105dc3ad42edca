"""The simulated rig, the estimator and the drift watch on one wire: messages, without nodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("flexarm_interfaces", reason="needs ROS")

from sensor_msgs.msg import JointState  # noqa: E402

from flexarm_bringup.drift_run.drives_alone import drive_alone  # noqa: E402
from flexarm_bringup.drift_run.normal_moves import normal_moves  # noqa: E402
from flexarm_bringup.sim.conversions import applied_effort_msg, samples_to_msgs  # noqa: E402
from flexarm_bringup.sim.rig import Rig, RigSettings  # noqa: E402
from flexarm_bringup.sim.sample import Sample  # noqa: E402
from flexarm_bringup.sim.sensor_fault_text import parse_faults  # noqa: E402
from flexarm_bringup.static_arm import StaticArm  # noqa: E402
from flexarm_bringup.tasks.task import find_task, load_task  # noqa: E402
from flexarm_bringup.topics import NAMESPACE  # noqa: E402
from flexarm_estimator.exchange import EstimatorExchange  # noqa: E402
from flexarm_estimator.interventions.intervention import Intervention  # noqa: E402
from flexarm_estimator.settings import EstimatorConfig  # noqa: E402
from flexarm_model.conversions import floats, model_to_msg, ns_to_stamp  # noqa: E402
from flexarm_model.manipulator.start_pose import starting_at  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

STATES = 20  # periods between two states of the estimator that are kept


class Wire:
    """What was said on it, in order: absolute topic and message each.

    Attributes:
        said: See above.
        config: Of the arm.
        estimator: Settings of the filter.
    """

    def __init__(self, faults: str, seconds: float, *done: Intervention, scale: float = 1.0) -> None:
        """Let the single link move under joint PD.

        Args:
            faults: Of the sensors, as the rig takes them.
            seconds: Of moves.
            done: To the estimator, at its first step.
            scale: Real over described frequencies.
        """
        task = load_task(find_task("single_link"))
        config = load_config(find_manipulator("single_link"), "geared")
        self.estimator = task.under("geared").make("estimator", EstimatorConfig)
        home, reference = normal_moves(
            StaticArm(ReducedTree(config)), task, 1.0 / config.rate_hz, seconds, seed=1
        )
        self.config = config = starting_at(config, home)
        model = linearize(ReducedTree(config))
        self.said: list[tuple[str, Any]] = []
        self._exchange, self._done = EstimatorExchange(config, self.estimator, 0), list(done)
        self._say("model", model_to_msg(model, 0), self._exchange.on_model)
        rig = Rig(
            config, RigSettings(seed=1, frequency_scale=scale), None, parse_faults(faults, config.sensors)
        )
        drive_alone(rig, model, reference, float(reference.t[-1]), self._hear)

    def _hear(self, rig: Rig, samples: list[Sample], tau: NDArray[np.float64]) -> None:
        stamp = round(rig.period_ns)
        names = list(self.config.actuated)
        effort = applied_effort_msg(names, tau.tolist(), (rig.tick - 1) * stamp)
        self._say("applied_effort", effort, lambda msg: self._exchange.on_sensor("applied_effort", msg))
        joints = JointState(name=names, position=floats([s.y[0] for s in samples if s.kind == "encoder"]))
        joints.header.stamp = ns_to_stamp(rig.tick * stamp)
        told = [(each.topic, each.msg) for each in samples_to_msgs(self.config, samples, stamp.__mul__)]
        for topic, msg in [*told, ("joint_states", joints)]:
            self._say(topic, msg, lambda msg, topic=topic: self._exchange.on_sensor(topic, msg))
        for intervention in self._done if rig.tick == 2 else ():
            for out in self._exchange.intervene(intervention):
                self._say(out.topic, out.msg)
        for out in self._exchange.step(rig.tick * stamp):
            if out.topic == "modal_state" and not rig.tick % STATES:
                self._say(out.topic, out.msg)

    def _say(self, topic: str, msg: Any, heard: Callable[[Any], object] = lambda msg: None) -> None:
        self.said.append((f"{NAMESPACE}/{topic}", msg))
        heard(msg)
