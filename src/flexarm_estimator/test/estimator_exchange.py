"""An exchange of the single link and messages for it, for the tests at message level."""

from functools import cache

import pytest
from planar_strip import single_link

exchange_module = pytest.importorskip("flexarm_estimator.exchange", reason="needs ROS and flexarm_interfaces")
messages = pytest.importorskip("sensor_msgs.msg")
model_conversions = pytest.importorskip("flexarm_model.conversions")

from flexarm_estimator.settings import EstimatorConfig  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

PERIOD_NS = 5_000_000
EPOCH_NS = 1_700_000_000_000_000_000


@cache
def model(preset="geared"):
    return linearize(ReducedTree(single_link(preset), use_compiler=False))


def exchange(epoch_ns=0, with_model=True):
    made = exchange_module.EstimatorExchange(single_link(), EstimatorConfig(), epoch_ns)
    if with_model:
        made.on_model(model_conversions.model_to_msg(model()))
    return made


def joints(stamp_ns, position=0.0, effort=()):
    msg = messages.JointState(name=["base.rz"], position=[position], effort=list(effort))
    msg.header.stamp = model_conversions.ns_to_stamp(stamp_ns)
    return msg
