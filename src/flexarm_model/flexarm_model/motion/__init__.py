"""Motions of the axes: profiles, shapers, trajectories."""
