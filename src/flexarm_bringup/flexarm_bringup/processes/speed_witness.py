"""How fast was the machine while something ran? A process times plain filterpy beside it, once a second.

Before and after a run says little: within one minute a shared machine takes 43 and 95 us for the same step.
Run as a program with the number of the process that asks, it does so at the lowest priority, in what time the
others leave, and prints every figure; that takes a hundredth of a core.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence

from flexarm_bringup.processes.machine_speed import filterpy_step_us

PERIOD = 1.0  # s
STEPS = 50
LOWEST = 19


class SpeedWitness:
    """Times the machine while it is entered; afterwards ``steps_us`` is complete.

    Attributes:
        steps_us: What ``filterpy_step_us`` took, in order of time; none of a run that was too short.
    """

    def __init__(self) -> None:
        """Start nothing yet."""
        self.steps_us: Sequence[float] = ()

    def __enter__(self) -> SpeedWitness:
        """Begin to time."""
        self._file = tempfile.TemporaryFile("w+")  # noqa: SIM115 (closed in __exit__)
        command = [sys.executable, "-m", __name__, str(os.getpid())]
        self._child = subprocess.Popen(command, stdout=self._file)
        return self

    def __exit__(self, *_: object) -> None:
        """Hear what was found."""
        self._child.terminate()
        self._child.wait()
        self._file.seek(0)
        self.steps_us = [float(line) for line in self._file if line.endswith("\n")]
        self._file.close()


def watch(parent: int) -> int:
    """Print what a step of plain filterpy takes [us], once a second, while the process that started it lives.

    Returns:
        Exit code.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal: it ends with its parent
    os.nice(LOWEST)
    while os.getppid() == parent:
        print(f"{filterpy_step_us(STEPS):.3f}", flush=True)
        time.sleep(PERIOD)
    return 0


if __name__ == "__main__":
    sys.exit(watch(*map(int, sys.argv[1:])))
