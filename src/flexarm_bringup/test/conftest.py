"""What the tests of this folder share: what lies beside them, and a DDS domain of their own."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def ros_environment(tmp_path: Path) -> Iterator[dict[str, str]]:
    """Environment of child processes: a free DDS domain on this machine only, logs in a folder of its own."""
    coordinator = pytest.importorskip("domain_coordinator", reason="needs ROS")
    with coordinator.domain_id() as domain:
        environment = {
            key: value for key, value in os.environ.items() if key != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
        }
        environment |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        environment |= {"ROS_LOG_DIR": str(tmp_path / "ros_log"), "OMP_NUM_THREADS": "1"}
        yield environment
