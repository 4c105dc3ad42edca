"""Every node of a running rig tells its health on /diagnostics, in figures that can be read."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
pytestmark = [pytest.mark.ros, pytest.mark.slow]

from flexarm_bringup.processes.graph import rig_graph  # noqa: E402
from flexarm_bringup.processes.running_graph_node import running  # noqa: E402
from flexarm_model.conversions import verdict_from_msg  # noqa: E402
from flexarm_model.settings.diagnosis import Verdict  # noqa: E402

LOOPS = {f"{node}: loop" for node in ("rig", "guard", "estimator", "controller")}
OTHERS = {
    "guard: commands", "controller: law", "estimator: state", "estimator: encoder", "estimator: camera",
    "estimator: root_strain", "estimator: tip_accelerometer", "estimator: normalised innovation",
    "model: served", "rig: faults",
}  # fmt: skip
PATIENCE = 60.0  # s


def test_all_nodes_tell_their_health_and_rates_are_near_the_control_rate(tmp_path: Path) -> None:
    with running(rig_graph(), ("/diagnostics",), tmp_path) as (_, ear):
        ear.wait_ready("model", "estimator", "controller", "guard", "rig")
        ear.heard["/diagnostics"].clear()
        told: dict[str, Verdict] = {}

        def is_complete() -> bool:
            told.update(
                {
                    verdict.subject: verdict
                    for array in ear.heard["/diagnostics"]
                    for verdict in map(verdict_from_msg, array.status)
                }
            )
            rates = [told[name].values.get("rate [Hz]") for name in LOOPS if name in told]
            return told.keys() >= LOOPS | OTHERS and None not in rates

        ear.wait(is_complete, PATIENCE, "all subjects")
    rates = {name: float(told[name].values["rate [Hz]"]) for name in LOOPS}
    assert all(50.0 < rate < 400.0 for rate in rates.values()), rates  # 200 Hz, also on a busy machine
    assert told["model: served"].values["model_id"] == told["estimator: state"].values["model_id"]
    assert {"encoder", "camera"} <= set(told["estimator: normalised innovation"].values)
