"""Libraries are loaded beside the work that goes on."""

import subprocess
import sys
import time

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


def test_nothing_to_load_is_done_at_once() -> None:
    loading = Loading(())
    while not loading.is_done:
        time.sleep(0.001)
