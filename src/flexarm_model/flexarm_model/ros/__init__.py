"""What every node shares: its life, its parameters, its messages as bytes, its timing."""
