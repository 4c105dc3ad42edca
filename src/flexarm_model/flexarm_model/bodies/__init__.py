"""Flexible bodies: beam finite elements, reduction to superelements, standard input data."""
