"""Messages that rosbag2 compressed one by one (``--compression-mode message``): each is a frame of zstd.

The frame says so itself: its first bytes are those of RFC 8878, 3.1.1. No CDR begins with them: its first
byte is 0 (DDSI-RTPS 2.5, 10.5).
"""

from __future__ import annotations

import sys

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

FRAME = b"\x28\xb5\x2f\xfd"


def unpacked(content: bytes) -> bytes:
    """Return a serialised message as it was before a recorder compressed it.

    One whose frame is damaged stays as it is: no message decodes from it.
    """
    if not content.startswith(FRAME):
        return content
    try:
        return zstd.decompress(content)
    except zstd.ZstdError:
        return content
