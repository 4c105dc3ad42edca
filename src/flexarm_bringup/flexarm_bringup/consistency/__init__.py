"""Consistency: does the estimator know how wrong it is?"""
