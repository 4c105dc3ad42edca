"""Names of columns for a machine: the heading over a group of columns goes with each of them.

On the page a group's heading stands over its first column alone, "home [Hz]" over "notes" and nothing over
"ours". A reader of JSON sees one column at a time: "home [Hz] notes", "home [Hz] ours".
"""

from __future__ import annotations

from collections.abc import Sequence


def column_names(titles: Sequence[str]) -> list[str]:
    """Return a name of one line for every column; no two are equal.

    Args:
        titles: As printed; a line break first says that the column belongs to the group on its left.
    """
    names: list[str] = []
    head = ""
    for title in titles:
        first, *below = title.split("\n")
        if first or not below:
            head = first if below else ""
        name = " ".join(part for part in (head, *below) if part) if below else title
        same = [other for other in names if other == name or other.startswith(f"{name} (")]
        names.append(f"{name} ({len(same) + 1})" if name in names else name)
    return names
