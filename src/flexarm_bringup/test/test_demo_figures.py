"""The torque in the demo's page: as large as it is, its limit drawn where it is near, the words beside it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from drawn import drawn_by

from flexarm_bringup.demo_run import figures
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

SCHEMES = (("lqr", "A"), ("mpc", "A"), ("mpc", "ZVD"))


def torque_plot(monkeypatch: pytest.MonkeyPatch, largest: float) -> tuple[Any, str]:
    """Return the drawing of a move that asks for so much torque [N m], and its caption."""
    t = np.linspace(-0.1, 2.0, 50)
    slot = SimpleNamespace(t=t, tau=largest * np.sin(20.0 * t)[:, None])
    move = SimpleNamespace(start=0.0, sign=1.0)
    outcomes = {
        key: SimpleNamespace(slot=slot, move=move, row=SimpleNamespace(scheme=", ".join(key)))
        for key in SCHEMES
    }
    said: list[figures.Figure] = []
    (plot,) = drawn_by(monkeypatch, figures, lambda: said.append(figures._torque(outcomes)))  # type: ignore[arg-type]
    return plot, said[0].caption


def limit() -> float:
    config = load_config(find_manipulator("single_link"), "geared")
    return next(iter(config.actuated.values())).effort


def test_torques_far_from_their_limit_fill_the_figure_and_the_limit_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plot, caption = torque_plot(monkeypatch, limit() / 7.0)
    low, high = plot.axes[0].get_ylim()
    assert 2.0 * limit() / 7.0 > 0.7 * (high - low)
    assert f"limit {limit():g} N m (not drawn" in caption


def test_a_limit_that_is_near_is_drawn_and_no_word_stands_on_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    plot, caption = torque_plot(monkeypatch, 0.9 * limit())
    (axes,) = plot.axes
    assert {line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"} == {-limit(), limit()}
    assert "dashed" in caption
    (legend,) = plot.legends
    assert not legend.get_window_extent().overlaps(axes.get_window_extent())
