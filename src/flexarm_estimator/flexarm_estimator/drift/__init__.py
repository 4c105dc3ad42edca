"""Watch for modes that drift: running frequency and damping with confidence, beside the estimator."""
