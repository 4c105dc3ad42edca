"""What of a description a modal test can be asked about: the parameters fitted when nobody names any.

Young's modulus of every beam, point masses, damping ratios, springs of axes and their dampers; of what
follows a parameter every value of its table. Which of them the data tell comes out of the fit.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from flexarm_model.reading.config import read_content

DAMPING_SPREAD = 1.0  # one sigma of ln zeta: damping is a guess until somebody measures it


def fittable(path: Path, preset: str = "") -> tuple[str, ...]:
    """Return "PATH" or "PATH=SPREAD" of every such parameter of a description."""
    content: Any = read_content(path, preset)
    found = [*_bodies(content.get("bodies", {})), *_springs(content.get("joints", {}))]
    return tuple(name for name, value in found if _is_positive(value))


def _bodies(bodies: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, body in bodies.items():
        for i, piece in enumerate(body.get("pieces", ())):
            yield f"bodies.{name}.pieces.{i}.youngs_modulus", piece.get("youngs_modulus")
        for i, point in enumerate(body.get("point_masses", ())):
            yield f"bodies.{name}.point_masses.{i}.mass", point.get("mass")
        yield f"bodies.{name}.damping_ratio={DAMPING_SPREAD}", body.get("damping_ratio")
        for factor, value in body.get("rayleigh", {}).items():
            yield f"bodies.{name}.rayleigh.{factor}={DAMPING_SPREAD}", value


def _springs(joints: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, joint in joints.items():
        for axis, content in (joint.get("axes") or {}).items():
            for key, spread in (("stiffness", ""), ("damping", f"={DAMPING_SPREAD}")):
                for path, value in _numbers(f"joints.{name}.axes.{axis}.{key}", (content or {}).get(key)):
                    yield f"{path}{spread}", value


def _numbers(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Return a number, or those of a table over a parameter."""
    if not isinstance(value, dict):
        yield path, value
        return
    for i, entry in enumerate(value.get("values", ())):
        yield f"{path}.values.{i}", entry


def _is_positive(value: Any) -> bool:
    try:
        return float(str(value).split()[0]) > 0.0
    except (ValueError, IndexError):
        return False
