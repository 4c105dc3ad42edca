"""What looks at the estimator from outside: frozen, shifted, late, noisy sensors, biases; their table."""
