"""Settings recomputed from an updated description: a file per rule, a proposal, a trial on the rig."""
