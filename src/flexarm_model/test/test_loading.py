"""Libraries are loaded beside the work that goes on."""

import subprocess
import sys
import time

import pytest

from flexarm_model.process.loading import Loading

PROGRAM = """
import sys, time
from flexarm_model.process.loading import Loading
before = sys.getswitchinterval()
loading = Loading(["slow_one", "json.tool"])
assert not loading.is_done and "json.tool" not in sys.modules
print("works on", flush=True)
while not loading.is_done:
    time.sleep(0.001)
assert sys.modules["slow_one"].DONE and "json.tool" in sys.modules
assert sys.getswitchinterval() == before
"""


def test_modules_are_loaded_while_the_caller_works_on(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "slow_one.py").write_text("import time\ntime.sleep(0.2)\nDONE = True\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{PROGRAM}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stdout == "works on\n", done.stderr


URGENT = """
import os
from flexarm_model.process.loading import Loading
from flexarm_model.process.punctual import raise_priority
if why := raise_priority(1): print(why); raise SystemExit
Loading(["json.tool"], 0, lambda: print(os.sched_getscheduler(0) == os.SCHED_OTHER)).wait()
print(os.sched_getscheduler(0) == os.SCHED_RR)
"""


def test_an_urgent_process_loads_as_any_other() -> None:
    """The controller kept the estimator, on the same core, from running until its state was too old."""
    done = subprocess.run([sys.executable, "-c", URGENT], capture_output=True, text=True, check=True)
    if "not permitted" in done.stdout:
        pytest.skip("this user may not raise priorities")
    assert done.stdout.split() == ["True", "True"]


def test_nothing_to_load_is_done_at_once() -> None:
    loading = Loading(())
    while not loading.is_done:
        time.sleep(0.001)
