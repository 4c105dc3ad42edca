"""Launch, simulated rig, bags and the flexarm command: what a lab starts (no ROS outside node files)."""

import flexarm_model  # noqa: F401  before NumPy: it limits BLAS to one thread
