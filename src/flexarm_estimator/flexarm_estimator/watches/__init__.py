"""What looks at the estimator from outside: frozen, shifted, late sensors, biases, and the table of them."""
