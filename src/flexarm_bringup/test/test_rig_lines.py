"""Lines of ``flexarm rig`` that cannot be written are no reason to stop an arm, but that nobody reads is."""

from __future__ import annotations

import errno
import os
import sys
from types import SimpleNamespace

import pytest

from flexarm_bringup.rig_run.lines import Lines


def failing(error: int) -> SimpleNamespace:
    def fail(*_: object) -> None:
        raise OSError(error, os.strerror(error))

    return SimpleNamespace(write=fail, flush=fail)


def test_a_full_disk_costs_its_lines_and_no_more(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = Lines()
    with monkeypatch.context() as full:
        full.setattr(sys, "stdout", failing(errno.ENOSPC))
        lines.say("guard: armed")
    assert lines.cut_off is None
    lines.say("guard: stopped")
    said = capsys.readouterr().out
    assert "stopped" in said and "armed" not in said


@pytest.mark.parametrize("error", [errno.EPIPE, errno.EIO])
def test_that_nobody_reads_any_more_is_noted(error: int, monkeypatch: pytest.MonkeyPatch) -> None:
    lines = Lines()
    monkeypatch.setattr(sys, "stdout", failing(error))
    lines.say("guard: armed")
    lines.say("guard: stopped")
    assert lines.cut_off is not None and lines.cut_off.errno == error
