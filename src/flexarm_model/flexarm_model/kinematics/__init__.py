"""Kinematics of arms and closed chains by their geometry: closed forms, numeric inverse, paths of the tip.

Tip goals of all arms are solved by ``numeric``. The closed forms (``planar_legs``, ``telescopic_legs``,
``elbow_arm``, ``spherical_wrist``) are a library, which also gives the other branches, and its oracle.
"""
