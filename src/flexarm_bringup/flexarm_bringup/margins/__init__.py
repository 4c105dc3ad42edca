"""``flexarm margins``: the spill-over gate over a grid of poses, as tables and figures."""
