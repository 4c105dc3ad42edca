"""Quadratic programs solved: one protocol, its backends, and the checks of their answers."""
