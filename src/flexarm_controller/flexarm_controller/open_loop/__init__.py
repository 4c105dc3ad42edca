"""Motions that need no feedback: shaped, best trapezoid, time-optimal; the baselines of every comparison."""
