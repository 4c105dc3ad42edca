"""Kinematics of arms and closed chains by their geometry: closed forms, numeric inverse, paths of the tip."""
