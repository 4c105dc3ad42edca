"""What goes wrong while a graph runs is told as what it is."""

import pytest

pytest.importorskip("rclpy", reason="needs rclpy")

from flexarm_bringup.processes.running_graph_node import running  # noqa: E402

pytestmark = pytest.mark.ros


def test_an_error_of_the_system_leaves_the_domain_as_what_it_is(tmp_path):
    with pytest.raises(OSError, match="No space left"), running((), (), tmp_path):
        raise OSError(28, "No space left on device")
