"""What all tests share: hypothesis draws the same examples in every run, and programs hear Ctrl-C.

A shell that runs tests in the background has SIGINT ignored, and whatever they start inherits that.
"""

import signal

from hypothesis import settings

settings.register_profile("flexarm", derandomize=True, max_examples=50, deadline=None)
settings.load_profile("flexarm")
signal.signal(signal.SIGINT, signal.default_int_handler)
