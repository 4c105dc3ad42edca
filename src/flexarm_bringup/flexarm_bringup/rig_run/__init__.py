"""The graph of processes on this machine, watched, until somebody ends it."""
