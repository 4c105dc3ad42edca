"""Filters behind one interface: linear, extended, unscented, and a smoother."""
