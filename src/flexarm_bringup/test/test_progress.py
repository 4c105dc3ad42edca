"""What is said while one waits."""

from __future__ import annotations

import pytest

from flexarm_bringup.progress import Progress


def test_who_waits_is_told_how_long_it_may_still_take(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A comparison of an arm of one's own told 7 of 21 jobs, and nobody knew whether to wait."""
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    tell = Progress().counted("simulating", "jobs")
    for seconds, done in ((0.0, 0), (8.0, 1), (20.0, 2), (98.0, 7), (200.0, 20), (280.0, 21)):
        now[0] = 100.0 + seconds
        tell(done, 21)
    said = [line.partition("] ")[2] for line in capsys.readouterr().err.splitlines()]
    assert said == [
        "simulating: 0 of 21 jobs",
        "simulating: 1 of 21 jobs",
        "simulating: 2 of 21 jobs, about 3 min left",
        "simulating: 7 of 21 jobs, about 3 min left",
        "simulating: 20 of 21 jobs, about 10 s left",
        "simulating: 21 of 21 jobs",
    ]


def test_what_is_to_stay_has_a_line_of_its_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    progress = Progress()
    progress.say("drawing")
    progress.tell("wrote a picture")
    progress.say("running nodes")
    seen = [line.rpartition("\r")[2] for line in capsys.readouterr().err.split("\n")]
    assert [line.partition("] ")[2] for line in seen] == ["wrote a picture", "running nodes"]
