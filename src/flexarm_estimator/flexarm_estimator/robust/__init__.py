"""Robust losses over a moving horizon."""
