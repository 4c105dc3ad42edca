"""Parameters for the quality of service of a topic are rclpy's; what only begins like one is nobody's."""

import pytest

pytest.importorskip("rclpy")
from flexarm_model.ros.declared_node import is_qos_override


@pytest.mark.parametrize(
    ("name", "is_one"),
    [
        ("qos_overrides./parameter_events.publisher.depth", True),
        ("qos_overrides./clock.subscription.reliability", True),
        ("qos_overrides./flexarm/joint_states.subscription_second.liveliness_lease_duration", True),
        ("qos_overrides.nonsense", False),
        ("qos_overrides.", False),
        ("qos_overrides.clock.subscription.depth", False),
        ("qos_overrides./clock.subscriber.depth", False),
        ("qos_overrides./clock.subscription.dept", False),
        ("qos_overrides./clock.subscription.depth.more", False),
        ("use_sim_time", False),
    ],
)
def test_one_for_the_quality_of_service_is_known_by_its_whole_form(name: str, is_one: bool) -> None:
    assert is_qos_override(name) == is_one
