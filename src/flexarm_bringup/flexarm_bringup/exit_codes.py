"""Exit codes that commands share; 0 is done, 1 that a bound is missed."""

UNUSABLE = 2  # what was given cannot be used
