"""Which channel lies, and how (flipped, detached, saturated, swapped), by consistency with the model."""
