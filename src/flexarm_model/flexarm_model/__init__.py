"""Reduced modal and Lagrangian dynamics of flexible multibody arms (no ROS in the core).

Importing it limits BLAS to one thread, which must happen before NumPy is imported: with two
threads on two busy cores small matrices were up to 95 times slower. Every other package of
flexarm imports this one first for that reason. What the user has set is kept.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
