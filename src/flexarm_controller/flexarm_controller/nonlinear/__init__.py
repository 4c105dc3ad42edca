"""Nonlinear predictive control: sequential quadratic programming, one iteration per period."""
