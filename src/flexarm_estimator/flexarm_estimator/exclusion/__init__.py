"""Fault exclusion: which sensor is at fault when the state was widened and yet they contradict each other."""
