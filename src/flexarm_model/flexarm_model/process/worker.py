"""The process that does tasks for a node (``beside``): reads them on its input, writes results on its output.

Both are pickled, with their length ahead. The first thing read makes what does the tasks; when that is there
None is written. What anything else prints goes where errors go. The end of the input is the end.
"""

from __future__ import annotations

import os
import pickle
import struct
import sys
from typing import Any, BinaryIO

from flexarm_model.process.parent import ending_with
from flexarm_model.process.process_title import set_process_title

MODULE = "flexarm_model.process.worker"
HEAD = struct.Struct("<Q")  # number of bytes that follow


def framed(thing: Any) -> bytes:
    """Return a thing as it is sent."""
    body = pickle.dumps(thing, pickle.HIGHEST_PROTOCOL)
    return HEAD.pack(len(body)) + body


def read(stream: BinaryIO) -> Any:
    """Return the next thing.

    Raises:
        EOFError: There is none, or none as a whole.
    """
    head = stream.read(HEAD.size)
    if len(head) < HEAD.size:
        raise EOFError
    return pickle.loads(stream.read(HEAD.unpack(head)[0]))


def main() -> None:
    """Do tasks until there are no more; the arguments are a name, the parent's number and the cores."""
    name, parent, cores = sys.argv[1:]
    os.sched_setaffinity(0, [int(core) for core in cores.split(",")])
    if not ending_with(int(parent))():
        return
    set_process_title(f"flexarm:{name}")
    tasks = sys.stdin.buffer
    with os.fdopen(os.dup(1), "wb") as results:
        os.dup2(2, 1)
        try:
            make, arguments = read(tasks)
            work = make(*arguments)
            result = None  # which says that it is ready
            while True:
                results.write(framed(result))
                results.flush()
                result = work(read(tasks))
        except (EOFError, BrokenPipeError):
            return


if __name__ == "__main__":
    main()
