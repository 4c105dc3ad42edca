"""``flexarm model``: what the modes of an arm are, in tables, words and drawings."""
