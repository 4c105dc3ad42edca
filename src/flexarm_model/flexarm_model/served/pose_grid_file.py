"""A grid of models as a folder: one file per model, and an index (docs/model_file.md)."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from flexarm_model.served.model_file import ModelFileError, load_model, save_model
from flexarm_model.served.pose_grid import Link, PoseGrid

FORMAT = "flexarm-grid/1"
INDEX = "index.json"


def save_grid(grid: PoseGrid, folder: Path | str) -> None:
    """Write a grid; the index comes last, so a folder with an index is whole.

    Raises:
        ModelFileError: A model cannot be saved exactly, or the folder holds another grid.
    """
    folder = Path(folder)
    if folder.exists() and any(folder.iterdir()):
        raise ModelFileError(f"{folder}: is not empty; give a new folder")
    folder.mkdir(parents=True, exist_ok=True)
    for model in grid.models:
        save_model(model, _model_path(folder, model.model_id))
    content = {
        "manipulator": grid.models[0].manipulator,
        "config_id": grid.models[0].config_id,
        "models": [{"model_id": model.model_id, "pose": model.pose.tolist()} for model in grid.models],
        "refused": [{"pose": list(pose), "why": why} for pose, why in grid.refused],
        "links": [
            {"old": link.old, "new": link.new, "mac": link.mac.tolist(), "change": link.change.tolist()}
            for link in grid.links
        ],
    }
    text = json.dumps({"format": FORMAT, "digest": _digest(content), **content}, indent=1, allow_nan=False)
    (folder / INDEX).write_text(text + "\n", encoding="utf-8")


def load_grid(folder: Path | str) -> PoseGrid:
    """Read a grid.

    Raises:
        ModelFileError: The index or a model is missing, damaged, of another version, or not what was saved.
    """
    folder = Path(folder)
    path = folder / INDEX
    try:
        content = json.loads(path.read_bytes().decode("utf-8"))
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise ModelFileError(f"{path}: is damaged or cut: {error}") from None
    if not isinstance(content, dict) or content.pop("format", None) != FORMAT:
        raise ModelFileError(f"{path}: is not of format {FORMAT!r}")
    said, found = content.pop("digest", None), _digest(content)
    if said != found:
        raise ModelFileError(f"{path}: was changed: it says {said} and holds {found}")
    models = []
    for entry in content["models"]:
        model = load_model(_model_path(folder, entry["model_id"]))
        if model.model_id != entry["model_id"]:
            raise ModelFileError(
                f"{_model_path(folder, entry['model_id'])}: holds model {model.model_id}, not the one listed"
            )
        models.append(model)
    links = (
        Link(link["old"], link["new"], np.array(link["change"], dtype=float), np.array(link["mac"]))
        for link in content["links"]
    )
    refused = ((tuple(entry["pose"]), entry["why"]) for entry in content["refused"])
    return PoseGrid(tuple(models), tuple(links), tuple(refused))


def _model_path(folder: Path, model_id: str) -> Path:
    return folder / f"{model_id}.json"


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]
