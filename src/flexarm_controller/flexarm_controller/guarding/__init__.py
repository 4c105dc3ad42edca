"""What the guard decides with: limits, ranges, loads, checks, energy, braking; all plain Python.

``derive``, ``hold_rate`` and ``pose_loads`` make limits and loads from the arm's model, outside its loop.
"""
