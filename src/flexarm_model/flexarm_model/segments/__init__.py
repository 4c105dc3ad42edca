"""The segment tree: the same arm in Pinocchio, beams as rigid segments joined by springs."""
