"""Bag regression as labs use it: a recorded bag, what must come of it, and where it first does not."""
