"""Services of a running rig from the command line: call any, arm, stop, move the tip."""
