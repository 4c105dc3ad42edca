"""Plots straight from a bag: one panel per question, those whose topics the bag lacks are named."""
