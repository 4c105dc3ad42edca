"""What stands in a drawing, found by rendering it: tests ask whether its words can be read."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from types import ModuleType
from typing import Any

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from flexarm_bringup.page.figures import Figure


def drawn_by(monkeypatch: pytest.MonkeyPatch, module: ModuleType, draw: Callable[[], object]) -> list[Any]:
    """Return the matplotlib figures that a module makes into SVG meanwhile, rendered."""
    plots: list[Any] = []
    to_figure = module.to_figure

    def keep(plot: Any, caption: str) -> Figure:
        FigureCanvasAgg(plot).draw()
        plots.append(plot)
        return to_figure(plot, caption)

    monkeypatch.setattr(module, "to_figure", keep)
    draw()
    return plots


def box_of(text: Text) -> Bbox:
    """Return where a word stands [pixel]."""
    return text.get_window_extent()


def overlapping(texts: list[Text]) -> list[tuple[str, str]]:
    """Return the pairs of words that stand on each other."""
    said = [text for text in texts if text.get_text() and text.get_visible()]
    pairs = combinations([(text.get_text(), box_of(text)) for text in said], 2)
    return [(one, other) for (one, here), (other, there) in pairs if here.overlaps(there)]
