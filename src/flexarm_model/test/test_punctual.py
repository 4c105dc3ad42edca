"""Priority and cores of a process."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from flexarm_model.process.punctual import ordinary_priority

CODE = """
import os, threading, time
from flexarm_model.process.punctual import raise_priority, stay_on
before = threading.Thread(target=time.sleep, args=(1.0,))
before.start()
first = min(os.sched_getaffinity(0))
print(repr(stay_on(())), repr(stay_on((first,))), repr(raise_priority(0)))
after = threading.Thread(target=time.sleep, args=(0.5,))
after.start()
threads = [int(name) for name in os.listdir("/proc/self/task")]
print(len(threads), all(os.sched_getaffinity(thread) == {first} for thread in threads))
print(stay_on((first, 4096)))
print(os.sched_getaffinity(0) == {first})
"""


def test_all_threads_stay_on_the_cores_asked_for_and_those_that_are_not_there_are_told():
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True, timeout=60
    )
    asked, threads, refusal, kept = done.stdout.splitlines()
    assert asked == "'' '' ''"
    count, are_there = threads.split()
    assert int(count) >= 3 and are_there == "True"
    assert "4096" in refusal and "may run on" in refusal
    assert kept == "True"


def said_by_urgent(code: str) -> str:
    """Return what a process prints that raises its priority; skips where the user may not."""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    if "not permitted" in done.stdout:
        pytest.skip("this user may not raise priorities")
    return done.stdout


def test_every_thread_gets_the_priority_where_the_user_may():
    code = (
        "import os, threading, time\n"
        "from flexarm_model.process.punctual import raise_priority\n"
        "threading.Thread(target=time.sleep, args=(0.5,)).start()\n"
        "print(raise_priority(1) or [os.sched_getscheduler(int(t)) for t in os.listdir('/proc/self/task')])"
    )
    policies = [int(number) for number in said_by_urgent(code).strip("[]\n").split(",")]
    assert len(policies) >= 2 and set(policies) == {os.SCHED_RR}


TURNS = """
import hashlib, os, threading, time
from flexarm_model.process.punctual import raise_priority, stay_on
stay_on((min(os.sched_getaffinity(0)),))
refused = raise_priority(1)
spin = threading.Thread(target=hashlib.pbkdf2_hmac, args=("sha256", b"a", b"b", 3_000_000))  # without the GIL
began = last = time.monotonic()
spin.start()
longest, spinning = 0.0, True
while spinning:
    spinning = spin.is_alive()
    now = time.monotonic()
    longest, last = max(longest, now - last), now
print(refused or f"{longest} {time.monotonic() - began}")
"""


def test_a_thread_that_spins_does_not_keep_the_core_from_others_of_its_priority():
    """A thread of DDS did, at the start of an estimator; the one that it waited for never ran again."""
    done = subprocess.run(
        [sys.executable, "-c", TURNS], capture_output=True, text=True, check=True, timeout=120
    )
    if "not permitted" in done.stdout:
        pytest.skip("this user may not raise priorities")
    longest, whole = map(float, done.stdout.split())
    assert longest < whole / 3


def test_what_takes_long_runs_as_any_other_on_any_core_and_its_threads_are_urgent_in_the_end():
    """A guard that was activated again kept the rig, on the same core, from running for 60 to 90 ms.

    A controller that judged margins got nothing of a core that an estimator filled, with another one idle.
    """
    code = (
        "import os, threading, time\n"
        "from flexarm_model.process.punctual import ordinary_priority, raise_priority, stay_on\n"
        "everywhere, first = os.sched_getaffinity(0), min(os.sched_getaffinity(0))\n"
        "stay_on((first,))\n"
        "if why := raise_priority(1): print(why); raise SystemExit\n"
        "with ordinary_priority():\n"
        "    print((os.sched_getscheduler(0), os.sched_getaffinity(0)) == (os.SCHED_OTHER, everywhere))\n"
        "    threading.Thread(target=time.sleep, args=(0.5,)).start()\n"
        "threads = [int(thread) for thread in os.listdir('/proc/self/task')]\n"
        "print({os.sched_getscheduler(thread) for thread in threads} == {os.SCHED_RR})\n"
        "print(all(os.sched_getaffinity(thread) == {first} for thread in threads))\n"
        "raise_priority(1)"
    )
    assert said_by_urgent(code).split() == ["True", "True", "True"]


def test_who_is_not_root_begins_ordinary_children_and_may_be_ordinary_after_that():
    """Linux lets only root take back that children are ordinary: to be so itself without that was refused."""
    code = (
        "import os, subprocess\n"
        "from flexarm_model.process.punctual import be_ordinary, ordinary_children, raise_priority\n"
        "if why := raise_priority(1): print(why); raise SystemExit\n"
        "if os.geteuid() == 0: os.setuid(65534)\n"
        "for _ in range(2):\n"
        "    with ordinary_children():\n"
        "        stat = subprocess.check_output(['cat', '/proc/self/stat'])\n"
        "    print(int(stat.split()[40]) == os.SCHED_OTHER)\n"
        "    print(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR)\n"
        "be_ordinary()\n"
        "print(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_OTHER)"
    )
    assert said_by_urgent(code).split() == ["True"] * 5


def test_an_ordinary_process_stays_as_it_is():
    with ordinary_priority():
        assert os.sched_getscheduler(0) == os.SCHED_OTHER
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
