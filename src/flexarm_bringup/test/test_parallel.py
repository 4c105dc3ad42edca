"""Jobs in processes of their own: order of the results, progress, and what a worker has to say."""

import logging

import pytest

from flexarm_bringup.parallel import run_parallel


def double(job: int) -> list[int]:
    logging.getLogger("flexarm").info("at work on %d", job)
    return [2 * job, 2 * job + 1]


def test_results_come_in_the_order_of_the_jobs_and_workers_announce_long_work(
    capfd: pytest.CaptureFixture[str],
) -> None:
    told: list[tuple[int, int]] = []
    assert run_parallel(double, [3, 1], lambda *done: told.append(done), workers=1) == [6, 7, 2, 3]
    assert told == [(1, 2), (2, 2)]
    said = capfd.readouterr().err
    assert "flexarm: at work on 3" in said
    assert "flexarm: at work on 1" in said
