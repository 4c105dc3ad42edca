"""The drift watch on a bag, and on the simulated rig: how soon it tells, how often without a cause."""
