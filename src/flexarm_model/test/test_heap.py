"""Large buffers go back to the system."""

import subprocess
import sys

import pytest

PROGRAM = """
import ctypes, sys
from flexarm_model.process.heap import give_back_large_buffers
assert sys.argv[1] == "as it is" or give_back_large_buffers()
libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
libc.free.argtypes = [ctypes.c_void_p]

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6

def use(size):
    place = libc.malloc(size)
    ctypes.memset(place, 1, size)
    return place

libc.free(use(10_000_000))  # from this one glibc learns
before = resident()
large, small = use(10_000_000), use(1000)  # what is small lies behind and keeps the heap from shrinking
libc.free(large)
print(resident() - before)
"""


@pytest.mark.parametrize(("how", "kept"), [("as it is", 9.0), ("fixed", 0.5)])
def test_a_large_buffer_is_given_back_when_the_thresholds_are_fixed(how: str, kept: float) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, how], capture_output=True, text=True, check=True)
    assert float(done.stdout) > kept if how == "as it is" else float(done.stdout) < kept
