"""A program that is asked to end while it starts a child hears it, and keeps the child's number."""

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from flexarm_bringup.processes.asked_to_end import ENDING, noting_signals


@pytest.mark.parametrize("number", ENDING)
def test_a_signal_is_noted_and_the_handler_of_before_comes_back(number: int) -> None:
    before = signal.getsignal(number)
    with noting_signals() as asked_to_end:
        assert not asked_to_end()
        os.kill(os.getpid(), number)
        assert asked_to_end()
    assert signal.getsignal(number) is before


def test_a_signal_that_comes_while_python_forks_is_not_lost(tmp_path: Path) -> None:
    program = textwrap.dedent(f"""
        import os, signal
        from pathlib import Path
        from flexarm_bringup.processes.asked_to_end import noting_signals
        from flexarm_bringup.processes.child import start_child

        os.register_at_fork(after_in_parent=lambda: os.kill(os.getpid(), signal.SIGINT))
        with noting_signals() as asked_to_end:
            child = start_child(["true"], dict(os.environ), Path({str(tmp_path / "log")!r}))
            assert asked_to_end() and child.process.wait() == 0
    """)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_exception_that_comes_while_python_forks_comes_after_it(tmp_path: Path) -> None:
    program = textwrap.dedent(f"""
        import os, signal
        from pathlib import Path
        from flexarm_bringup.processes.child import start_child

        signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have had it ignored
        os.register_at_fork(after_in_parent=lambda: os.kill(os.getpid(), signal.SIGINT))
        try:
            start_child(["true"], dict(os.environ), Path({str(tmp_path / "log")!r}))
        except KeyboardInterrupt:
            print("heard")
    """)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "heard\n", "")
