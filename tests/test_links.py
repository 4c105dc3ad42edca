"""Links of the manual lead somewhere: relative ones to a file, those with an anchor to a heading of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
SOURCES = [
    *(path for kind in ("*.py", "*.yaml", "*.c") for path in sorted((ROOT / "src").rglob(kind))),
    *sorted((ROOT / "tests").glob("*.py")),
]
CODE = re.compile(r"^ *```.*?^ *```|`[^`\n]*`", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^()\s]+)\)")
NAMED = re.compile(r"\bdocs/\w+\.(?:md|yaml|svg)\b(?:#[\w-]+)?")
HEADING = re.compile(r"^#{1,6} +(.+?) *#*$", re.MULTILINE)
ELSEWHERE = ("http://", "https://", "mailto:")


def anchors(text: str) -> set[str]:
    """Anchors that GitHub gives the headings of a page; the second of a name ends with -1."""
    found: list[str] = []
    outside = re.sub(r"^ *```.*?^ *```", "", text, flags=re.DOTALL | re.MULTILINE)
    for heading in HEADING.findall(outside):
        shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)  # of a link its text
        name = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
        found.append(name)
    return {f"{name}-{n}" if (n := found[:i].count(name)) else name for i, name in enumerate(found)}


def fault(link: str, page: Path) -> str:
    """Say why a link of a page leads nowhere; empty when it leads somewhere."""
    name, _, anchor = link.partition("#")
    target = page.parent / name if name else page
    if not target.exists():
        return f"{page.name}: {link}: there is no {name}"
    if anchor and anchor not in anchors(target.read_text(encoding="utf8")):
        return f"{page.name}: {link}: {target.name} has no such heading"
    return ""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_relative_link_of_a_page_leads_to_a_file_and_a_heading(page: Path) -> None:
    links = LINK.findall(CODE.sub("", page.read_text(encoding="utf8")))
    assert [told for link in links if not link.startswith(ELSEWHERE) and (told := fault(link, page))] == []


def test_every_page_that_the_sources_name_is_there() -> None:
    texts = ((path, path.read_text(encoding="utf8", errors="replace")) for path in SOURCES)
    named = [(path, link) for path, text in texts for link in NAMED.findall(text)]
    assert len(named) > 20
    told = {f"{path.name}: {fault(link, ROOT / 'README.md')}" for path, link in named}
    assert {text for text in told if not text.endswith(": ")} == set()


def test_links_that_lead_nowhere_are_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# It's `a` page: one, two\n\n## Same\n\n## Same\n\n```\n# no heading\n```\n", encoding="utf8"
    )
    assert anchors(page.read_text(encoding="utf8")) == {"its-a-page-one-two", "same", "same-1"}
    assert not fault("page.md#same-1", page) and not fault("#its-a-page-one-two", page)
    assert fault("page.md#same-2", page).endswith("page.md has no such heading")
    assert fault("other.md#same", page).endswith("there is no other.md")


def test_every_page_is_reached_from_the_readme() -> None:
    seen, left = set[Path](), [ROOT / "README.md"]
    while left:
        page = left.pop()
        seen.add(page)
        links = LINK.findall(CODE.sub("", page.read_text(encoding="utf8")))
        targets = {(page.parent / link.partition("#")[0]).resolve() for link in links if ".md" in link}
        left += sorted(path for path in targets - seen if path.suffix == ".md" and path.is_relative_to(ROOT))
    assert set(PAGES) <= seen
