"""What all tests share: hypothesis draws the same examples in every run."""

from hypothesis import settings

settings.register_profile("flexarm", derandomize=True, max_examples=50, deadline=None)
settings.load_profile("flexarm")
