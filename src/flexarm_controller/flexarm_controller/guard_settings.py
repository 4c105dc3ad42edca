"""The guard's settings, and the limits that follow from them and from the arm: see ``guarding.derive``."""

from flexarm_controller.guarding.derive import GuardSettings, guard_limits

__all__ = ["GuardSettings", "guard_limits"]
