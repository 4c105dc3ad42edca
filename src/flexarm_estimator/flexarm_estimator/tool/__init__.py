"""The tool point as a function of the state."""
