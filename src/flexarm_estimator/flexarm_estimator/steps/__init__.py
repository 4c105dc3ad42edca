"""Prediction and update as one step of matrices, in machine code or NumPy."""
