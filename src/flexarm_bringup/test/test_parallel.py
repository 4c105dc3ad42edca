"""Jobs in processes of their own: order of results, progress, what a worker has to say, when it ends."""

import logging
import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flexarm_bringup import reproduce
from flexarm_bringup.cli import main
from flexarm_bringup.page.report import Page
from flexarm_bringup.parallel import run_parallel


def double(job: int) -> list[int]:
    logging.getLogger("flexarm").info("at work on %d", job)
    return [2 * job, 2 * job + 1]


def test_results_come_in_the_order_of_the_jobs_and_workers_announce_long_work(
    capfd: pytest.CaptureFixture[str],
) -> None:
    told: list[tuple[int, int]] = []
    assert run_parallel(double, [3, 1], lambda *done: told.append(done), workers=1) == [6, 7, 2, 3]
    assert (told[0], told[-1]) == ((0, 2), (2, 2))
    assert told == sorted(told)
    said = capfd.readouterr().err
    assert "flexarm: at work on 3" in said
    assert "flexarm: at work on 1" in said


def sleep(job: int) -> list[int]:
    os.write(1, b"asleep\n")
    time.sleep(60)
    return []


def be_killed(job: int) -> list[int]:
    os.kill(os.getpid(), signal.SIGKILL)
    return []


def test_a_worker_that_is_killed_is_told_and_no_missed_bound(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A traceback ends with 1, which says that a bound was missed."""

    def compare_all(figures: bool) -> dict[str, Page]:
        run_parallel(be_killed, [1, 2], lambda *done: None, workers=2)
        raise AssertionError("nothing came back")

    monkeypatch.setattr(reproduce, "compare_all", compare_all)
    assert main(["reproduce", "all"]) == 2
    assert "flexarm reproduce: a worker process was killed at its work" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_who_gave_them_work(number: int) -> None:
    """SIGTERM, which timeouts and service managers send, left them behind; Ctrl-C waited for their work."""
    begin = "signal.signal(signal.SIGINT, signal.default_int_handler)"  # also where a shell ignores it
    work = "run_parallel(test_parallel.sleep, [1, 2, 3], lambda *done: None, workers=2)"
    script = "import signal, test_parallel\nfrom flexarm_bringup.parallel import run_parallel\n"
    script += f"if __name__ == '__main__':\n    {begin}\n    {work}\n"
    command = [sys.executable, "-c", script]
    environment = {**os.environ, "PYTHONPATH": f"{Path(__file__).parent}:{os.environ.get('PYTHONPATH', '')}"}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True
    ) as parent:
        assert parent.stdout is not None
        try:
            assert [os.read(parent.stdout.fileno(), 7) for _ in range(2)] == [b"asleep\n"] * 2
            parent.send_signal(number)
            assert select.select([parent.stdout], [], [], 40.0)[0]
            assert os.read(parent.stdout.fileno(), 1) == b""  # nobody is left who could write
            parent.wait(40.0)
        finally:
            if parent.poll() is None:
                os.killpg(parent.pid, signal.SIGKILL)
