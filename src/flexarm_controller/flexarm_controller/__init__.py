"""Model predictive control on the served model: problem, solvers, fallbacks, guard (no ROS in the core)."""

import flexarm_model  # noqa: F401  before NumPy: it limits BLAS to one thread
