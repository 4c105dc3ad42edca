"""``flexarm sim``: rig, estimator and controller of any arm in one process, joint PD beside MPC."""
