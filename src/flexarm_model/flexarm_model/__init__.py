"""Reduced modal and Lagrangian dynamics of flexible multibody arms (no ROS in the core)."""
