"""What ``ps`` and ``top`` call a process: ``flexarm:estimator`` instead of the interpreter's path.

Linux only, without a library: the title is written over the arguments that the kernel shows (their place is
told in /proc, proc_pid_stat(5) fields 48 and 49), and the name of the main thread is set by prctl(2), which
keeps 15 characters of it.
"""

from __future__ import annotations

import ctypes
from pathlib import Path

_PR_SET_NAME = 15  # linux/prctl.h
_ARGUMENTS = slice(45, 47)  # of the fields behind the name, which begin with the third


def set_process_title(title: str) -> bool:
    """Name this process; call it from its main thread.

    Args:
        title: At most as long as the command line was is shown by ``ps -f``.

    Returns:
        Whether ``ps -f`` shows it, too; False where the kernel does not tell where the arguments are.
    """
    name = title.encode()
    ctypes.CDLL(None).prctl(_PR_SET_NAME, ctypes.c_char_p(name), 0, 0, 0)
    try:
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        start, end = map(int, fields[_ARGUMENTS])
    except (OSError, ValueError):
        return False
    if end <= start:
        return False
    shown = name[: end - start - 1]
    ctypes.memmove(start, shown.ljust(end - start, b"\0"), end - start)
    return True
