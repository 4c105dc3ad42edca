"""One thing that was looked at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["ok", "hint", "FAULT"]


@dataclass(frozen=True)
class Finding:
    """What was found, and what to do about it.

    Attributes:
        verdict: "ok"; "hint" for what costs performance; "FAULT" for what does not work.
        subject: What was looked at, in a word or two.
        text: What was found, with numbers.
        cure: What to do; empty when it is ok.
    """

    verdict: Verdict
    subject: str
    text: str
    cure: str = ""
