"""Rotations, small matrices, compiled functions."""
