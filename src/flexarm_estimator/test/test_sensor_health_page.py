"""docs/sensor_health.md quotes what the estimator prints, and all that the judges may print."""

import re
from pathlib import Path

import pytest

from flexarm_estimator.isolation.hypotheses import FLIPPED
from flexarm_estimator.judging import repeats, sample_judge, short_term

PACKAGE = Path(repeats.__file__).resolve().parents[1]
PAGE = Path(__file__).resolve().parents[3] / "docs" / "sensor_health.md"
SETTING = re.compile(r"[a-z0-9_]+(: \{.*)?|\./flexarm.*|/diagnostics|…")


def quoted() -> list[str]:
    return [text for text in re.findall(r"`([^`]+)`", PAGE.read_text()) if not SETTING.fullmatch(text)]


@pytest.mark.parametrize("text", quoted())
def test_what_the_page_quotes_stands_in_the_code(text: str) -> None:
    code = "\n".join(path.read_text() for path in PACKAGE.rglob("*.py"))
    parts = [part.strip() for part in re.split(r"…|, (?=though)", text) if len(part.strip(" ,'[]()")) > 1]
    assert parts and all(part in code for part in parts)


@pytest.mark.parametrize(
    "said",
    [sample_judge.FAR, short_term.HELD, short_term.JUMP, short_term.SHIFT, short_term.LEAP]
    + [repeats.SAME, FLIPPED]
    + [text.partition(", ")[2] for text in (repeats.FROZEN, repeats.STUCK)],
)
def test_what_a_judge_says_stands_on_the_page(said: str) -> None:
    assert said in PAGE.read_text()
