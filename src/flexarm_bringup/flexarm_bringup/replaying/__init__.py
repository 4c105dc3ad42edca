"""A bag through estimator and controller again, and where two bags differ."""
