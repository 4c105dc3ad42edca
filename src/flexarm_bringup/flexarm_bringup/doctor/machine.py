"""The machine: interpreter, cores, real-time rights, clock, memory, disk, threads of the linear algebra."""

from __future__ import annotations

import os
import platform
import resource
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.processes.timing import REALTIME_PRIORITY
from flexarm_model.numeric.compiled import find_compiler

SUPPORTED = ((3, 10), (3, 13))  # from, to
CORES = 2
SLEEP, TRIALS, LATE = 1e-3, 200, 2e-3  # s, number, s: how late a short sleep ends
MEMORY, DISK = 2e9, 2e9  # bytes free
GOVERNOR = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")


def look_at_machine(folder: Path) -> Iterator[Finding]:
    """Yield what the machine is like; ``folder`` is where logs and bags go."""
    yield _python()
    yield _compiler()
    yield _cores()
    yield _priority()
    yield _governor()
    yield _punctuality()
    yield _clocks()
    yield _room("memory", _free_memory(), MEMORY, "close other programs")
    yield _room("disk", shutil.disk_usage(folder).free, DISK, f"free some space on the disk of {folder}")
    yield _threads()


def _python() -> Finding:
    version = sys.version_info[:2]
    text = f"Python {platform.python_version()}"
    if SUPPORTED[0] <= version <= SUPPORTED[1]:
        return Finding("ok", "interpreter", text)
    return Finding("FAULT", "interpreter", text, "use 3.10 to 3.13; FLEXARM_PYTHON chooses one")


def _compiler() -> Finding:
    compiler = find_compiler()
    if compiler:
        return Finding("ok", "compiler", str(compiler))
    return Finding("hint", "compiler", "none: dynamics run in a virtual machine", "install gcc or g++")


def _cores() -> Finding:
    count = len(os.sched_getaffinity(0))
    if count >= CORES:
        return Finding("ok", "cores", f"{count}")
    return Finding("hint", "cores", f"{count}; {CORES} keep the loop free of everything else", "free a core")


def _priority() -> Finding:
    refusal = _refusal_of_priority()
    if not refusal:
        return Finding("ok", "priority", f"SCHED_RR {REALTIME_PRIORITY} is allowed")
    limit = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    cure = f"'rtprio {REALTIME_PRIORITY}' for your user in /etc/security/limits.d, then log in again"
    if os.geteuid() == 0:  # without the rights of root, as in most containers
        cure = "start the container with the capability SYS_NICE (docker run --cap-add SYS_NICE)"
    return Finding("hint", "priority", f"SCHED_RR {REALTIME_PRIORITY}: {refusal}; rtprio is {limit}", cure)


def _refusal_of_priority() -> str:
    """Return why the kernel refuses a thread the priority of a node; empty where it grants it."""
    refusals: list[str] = []

    def ask() -> None:
        """Ask for it; what the kernel says is kept."""
        try:
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(REALTIME_PRIORITY))  # of this thread alone
        except OSError as error:
            refusals.append(error.strerror or "refused")

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    return "".join(refusals)


def _governor() -> Finding:
    try:
        governor = GOVERNOR.read_text().strip()
    except OSError:
        return Finding("ok", "clock rate", "not scaled, or not told")
    if governor == "performance":
        return Finding("ok", "clock rate", governor)
    return Finding("hint", "clock rate", f"governor '{governor}'", "cpupower frequency-set -g performance")


def _punctuality() -> Finding:
    late = []
    for _ in range(TRIALS):
        started = time.perf_counter()
        time.sleep(SLEEP)
        late.append(time.perf_counter() - started - SLEEP)
    late.sort()
    worst = late[int(0.99 * TRIALS)]
    text = f"a sleep of 1 ms ends {1e3 * worst:.2f} ms late (99th percentile of {TRIALS})"
    if worst <= LATE:
        return Finding("ok", "punctuality", text)
    return Finding("hint", "punctuality", text, "less load beside; realtime_priority; a PREEMPT_RT kernel")


def _clocks() -> Finding:
    before = time.time() - time.monotonic()
    time.sleep(0.05)
    drift = abs(time.time() - time.monotonic() - before)
    text = f"wall and monotonic clock part by {1e6 * drift:.0f} us in 50 ms"
    if drift < 1e-3:
        return Finding("ok", "clock", text)
    return Finding("FAULT", "clock", text, "something sets the clock in steps: let chrony slew it")


def _free_memory() -> float:
    lines = Path("/proc/meminfo").read_text().splitlines()
    kilobytes = next(line.split()[1] for line in lines if line.startswith("MemAvailable"))
    return 1024.0 * float(kilobytes)


def _room(subject: str, free: float, needed: float, cure: str) -> Finding:
    text = f"{free / 1e9:.1f} GB free"
    return Finding("ok", subject, text) if free >= needed else Finding("hint", subject, text, cure)


def _threads() -> Finding:
    value = os.environ.get("OMP_NUM_THREADS", "")
    if value == "1":
        return Finding("ok", "threads", "linear algebra uses one")
    return Finding("hint", "threads", f"OMP_NUM_THREADS={value or 'unset'}", "export OMP_NUM_THREADS=1")
