"""Mode shapes at the sensors as small multiples that move: an inline SVG, animated without scripts.

Every small figure is one mode: a bar per sensor, as tall as its part of the shape. In time each part swings
as ``Re psi_o exp(j phi)``, so the parts of a real mode rise and fall together and those of a complex one
follow each other. Sensors of different units cannot share an axis: a bar counts by the largest of its unit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.figures import COLOURS, Figure

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
WIDTH, HEIGHT, GAP = 210.0, 128.0, 16.0  # of a small figure [px]
COLUMNS, MOST = 4, 16
STEPS = 24  # frames of a swing
SECONDS = 1.6  # of a swing
BASE, REACH = 66.0, 38.0  # middle line and largest bar [px]
LABEL = 12  # characters of a sensor's name that fit
UNLABELLED = 18.0  # px that are not needed without labels
LABELLED = 32.0  # px of a bar that has room for a label; the others tell their name when pointed at


def shapes_figure(
    f_hz: Array, zeta: Array, shapes: Complex, names: Sequence[str], units: Sequence[str] = ()
) -> Figure:
    """Return the animated shapes.

    Args:
        f_hz: Frequencies [Hz], (r,).
        zeta: Damping ratios [1], (r,).
        shapes: At the sensors, (r, n_out).
        names: Of the sensors, (n_out,).
        units: Of the sensors; those of one unit are scaled together. Empty scales all together.
    """
    groups = list(units) or [""] * len(names)
    count = min(len(f_hz), MOST)
    rows, columns = -(-count // COLUMNS), min(COLUMNS, count)
    height = HEIGHT if WIDTH / len(names) > LABELLED else HEIGHT - UNLABELLED
    small = "".join(
        f'<g transform="translate({i % COLUMNS * (WIDTH + GAP):.1f} {i // COLUMNS * (height + GAP):.1f})">'
        f"{_one(float(f_hz[i]), float(zeta[i]), scaled(shapes[i], groups), names, groups)}</g>"
        for i in range(count)
    )
    below = rows * (height + GAP)
    legend = "".join(
        f'<rect x="{130 * k}" y="{below:.0f}" width="9" height="9" fill="{COLOURS[k % len(COLOURS)]}"/>'
        f'<text x="{130 * k + 14}" y="{below + 8:.0f}">{unit}</text>'
        for k, unit in enumerate(dict.fromkeys(groups))
        if unit
    )
    box = f"0 0 {max(columns * (WIDTH + GAP), 460):.0f} {below + 16:.0f}"
    svg = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" font-size="9" fill="currentColor" '
        f'style="max-width:{max(columns * 240, 480)}px">{small}{legend}</svg>'
    )
    left = f" The first {MOST} of {len(f_hz)}." if len(f_hz) > MOST else ""
    return Figure(
        "Shapes at the sensors, one bar each, in motion: bars of a real mode rise and fall together, those "
        f"of a complex one follow each other. Sensors of one unit share a scale.{left}",
        svg,
    )


def scaled(shape: Complex, groups: Sequence[str]) -> Complex:
    """Return a shape turned so that it is as real as can be, by its largest part of every unit, (n_out,)."""
    turned = shape * np.exp(-0.5j * np.angle(np.sum(shape**2)))
    size = np.array([max(abs(turned[[k == g for k in groups]]).max(), 1e-300) for g in groups])
    return np.asarray(turned / size)


def _one(f: float, zeta: float, shape: Complex, names: Sequence[str], groups: Sequence[str]) -> str:
    step = WIDTH / len(names)
    order = list(dict.fromkeys(groups))
    bars = "".join(
        _bar(i * step, step, part, COLOURS[order.index(group) % len(COLOURS)], name)
        for i, (part, name, group) in enumerate(zip(shape, names, groups, strict=True))
    )
    return (
        f'<text x="0" y="11" font-size="12" font-weight="600">{f:.4g} Hz</text>'
        f'<text x="{WIDTH:.0f}" y="11" text-anchor="end" opacity=".7">{100 * zeta:.3g} %</text>'
        f'<line x1="0" x2="{WIDTH:.0f}" y1="{BASE}" y2="{BASE}" stroke="currentColor" opacity=".35"/>{bars}'
    )


def _bar(x: float, step: float, part: complex, colour: str, name: str) -> str:
    """Return one swinging bar, and its label where it fits."""
    phases = 2 * np.pi * np.arange(STEPS + 1) / STEPS
    now, still = REACH * np.real(part * np.exp(1j * phases)), REACH * part.real
    tops = ";".join(f"{BASE - max(value, 0.0):.1f}" for value in now)
    heights = ";".join(f"{abs(value):.1f}" for value in now)
    swing = f'dur="{SECONDS}s" repeatCount="indefinite"'
    label = name if len(name) <= LABEL else f"{name[: LABEL - 1]}…"
    at = f"translate({x + 0.3 * step:.1f} {BASE + REACH + 8:.0f}) rotate(20)"
    text = f'<text transform="{at}" opacity=".75">{label}</text>' if step > LABELLED else ""
    return (
        f'<rect x="{x + 0.19 * step:.1f}" y="{BASE - max(still, 0.0):.1f}" width="{0.62 * step:.1f}" '
        f'height="{abs(still):.1f}" fill="{colour}"><title>{name}: {abs(part):.2f} at '
        f"{np.degrees(np.angle(part)):.0f}°</title>"
        f'<animate attributeName="y" values="{tops}" {swing}/>'
        f'<animate attributeName="height" values="{heights}" {swing}/></rect>{text}'
    )
