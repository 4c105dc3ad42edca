"""State estimation of flexible arms: process, sensors, filter, history (no ROS in the core)."""

import flexarm_model  # noqa: F401  before NumPy: it limits BLAS to one thread
