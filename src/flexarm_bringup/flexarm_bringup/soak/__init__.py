"""``flexarm soak``: hours of moves, faults and restarts, and what they leave behind."""
