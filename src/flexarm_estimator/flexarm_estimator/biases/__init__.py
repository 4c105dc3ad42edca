"""Offsets of sensors as states: which can be learned, how fast, and within what limits."""
