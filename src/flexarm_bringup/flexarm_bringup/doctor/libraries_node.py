"""Says whether the middleware has security libraries: asked for a node whose keys are empty.

Nobody on the net hears of it: with the libraries it refuses the keys, without them it has no use for them.
Started by ``flexarm doctor`` in a process of its own, with such a keystore in its environment.
"""

from __future__ import annotations

import sys

from rclpy.node import Node

from flexarm_model.process.security import SecurityError
from flexarm_model.ros.tool_node import in_domain

# What says that there are none: rmw_fastrtps 8.4, participant.cpp; rmw_cyclonedds 2.2, rmw_node.cpp.
NONE = ("security libraries", "security support")
UNKEPT = "the middleware makes a node with empty keys, though they are enforced; install one that reads them"


def main() -> int:
    """Print in one line what is wrong, nothing where all is well; returns the exit code."""
    try:
        with in_domain():
            Node("doctor", namespace="flexarm", start_parameter_services=False).destroy_node()
    except SecurityError as error:
        if any(words in str(error) for words in NONE):
            print(error)
        return 0
    print(UNKEPT)
    return 0


if __name__ == "__main__":
    sys.exit(main())
