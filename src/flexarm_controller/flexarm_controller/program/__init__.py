"""The quadratic program of the predictive controller: prediction, cost, limits, preview of the reference."""
