"""The drift watch as a node: it says that it has no model, and takes one."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

rclpy = pytest.importorskip("rclpy", reason="needs ROS")
pytestmark = pytest.mark.ros


def spin_until(executor: object, is_true: Callable[[], bool], seconds: float = 60.0) -> bool:
    end = time.monotonic() + seconds
    while not is_true() and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)  # type: ignore[attr-defined]
    return is_true()


def test_it_waits_for_a_model_and_takes_it_and_then_states_of_the_estimator(
    ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from diagnostic_msgs.msg import DiagnosticArray
    from flexarm_interfaces.msg import ModalState, ReducedModel
    from rclpy.executors import SingleThreadedExecutor

    from flexarm_estimator.drift_node import DriftNode
    from flexarm_model.conversions import model_to_msg
    from flexarm_model.reading.config import load_config
    from flexarm_model.reading.manipulator_file import find_manipulator
    from flexarm_model.ros.node import MODELS_QOS
    from flexarm_model.served.linearize import linearize
    from flexarm_model.tree.reduced_tree import ReducedTree

    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    rclpy.init()
    try:
        node, told = DriftNode(), list[str]()
        node.create_subscription(
            DiagnosticArray, "/diagnostics", lambda msg: told.extend(s.message for s in msg.status), 10
        )
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        assert spin_until(executor, lambda: "no model yet" in told)
        model = linearize(ReducedTree(load_config(find_manipulator("single_link"), "geared")))
        node.create_publisher(ReducedModel, "model", MODELS_QOS).publish(model_to_msg(model, 0))
        assert spin_until(executor, lambda: node.exchange.watch is not None)
        heard = list[Any]()
        monkeypatch.setattr(node.exchange, "on_state", heard.append)
        state = node.create_publisher(ModalState, "modal_state", 10)
        assert spin_until(executor, lambda: not state.publish(ModalState(reason="mine")) and bool(heard))
        assert heard[0].reason == "mine"
        node.stop()
    finally:
        rclpy.try_shutdown()
