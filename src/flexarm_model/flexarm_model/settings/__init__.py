"""What people write, never guessed at: YAML, quantities with units, parameters with ranges."""
