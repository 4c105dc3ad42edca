"""The simulated rig: what stands in for hardware."""
