"""What the filter estimates, how it moves, and what the sensors say of it."""
