"""``flexarm monitor``: what a running rig does, in a terminal."""
