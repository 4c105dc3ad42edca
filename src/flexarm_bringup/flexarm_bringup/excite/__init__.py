"""Excitation of a rig through its guard: plan, sensor check, records."""
