"""``flexarm demo``: the single link's comparison, and any arm's moves with nodes over DDS."""
