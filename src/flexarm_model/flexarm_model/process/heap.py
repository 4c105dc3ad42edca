"""The C library's heap: what was large goes back to the system when it is freed.

By itself glibc learns from the first large buffer that is freed to keep later ones (the dynamic threshold of
mallopt(3)), so that after messages of 10 MB a node holds 20 MB and more for good. With fixed thresholds it
holds what DDS keeps for its next message.
"""

from __future__ import annotations

import ctypes

LARGE = 1 << 20  # bytes; from here on a buffer has pages of its own
KEPT = 8 << 20  # bytes of free heap that are kept, so that a loop does not ask for pages again and again
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h


def give_back_large_buffers() -> bool:
    """Fix the thresholds of this process; return whether the C library can."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    return bool(mallopt(_M_MMAP_THRESHOLD, LARGE) and mallopt(_M_TRIM_THRESHOLD, KEPT))
