"""What the guard decides with: limits, ranges, loads, checks, energy, braking; plain Python but for the last two.

``derive`` and ``pose_loads`` make limits and loads from the model of the arm, outside the guard's loop.
"""
