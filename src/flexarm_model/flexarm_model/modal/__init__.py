"""Modal analysis of linear models and of measured frequency responses (NumPy and SciPy only)."""
