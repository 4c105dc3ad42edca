"""Served models in files: JSON text that gives every bit back (docs/model_file.md).

The file holds its ``model_id``. What is read must hash to it and be written as ``format_model`` writes it,
so a file that was damaged, cut or edited is refused.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from flexarm_model.served.reduced_model import Outputs, ReducedModel

FORMAT = "flexarm-model/1"
_HEAD = ("format", "model_id")


class ModelFileError(ValueError):
    """The file holds no model that can be used; the message names file and reason."""


def save_model(model: ReducedModel, path: Path | str) -> None:
    """Write a model; a reader sees the old file or the whole new one.

    Raises:
        ModelFileError: The model holds values that a file cannot give back (not finite, not float64), or the
            file cannot be written.
    """
    text, path = format_model(model), Path(path)
    try:
        parse_model(text, str(path))
    except ModelFileError as error:
        raise ModelFileError(f"cannot be saved exactly: {error}") from None
    if path.exists() and not (path.is_file() or path.is_dir()):  # whose place the file would take
        raise ModelFileError(
            f"{path}: is no regular file; expected a name for a new one, or for one to replace"
        )
    written = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        written.write_bytes(text.encode("utf-8"))
        written.replace(path)
    except OSError as error:
        written.unlink(missing_ok=True)
        raise ModelFileError(f"{path}: cannot be written ({error.strerror})") from None


def load_model(path: Path | str) -> ReducedModel:
    """Read a model.

    Raises:
        ModelFileError: It cannot be read, is of another version, or is not what was saved.
    """
    try:
        text = Path(path).read_bytes().decode("utf-8")  # as it is: no other line ends
    except OSError as error:
        raise ModelFileError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise ModelFileError(f"{path}: is damaged: not UTF-8 text") from None
    return parse_model(text, str(path))


def format_model(model: ReducedModel) -> str:
    """Return the text of a model; equal models have equal texts."""
    head = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in _head(model.model_id).items()]
    body = [f" {json.dumps(key)}: {text}" for key, text in _entries(model)]
    outputs = ",\n".join(f"  {json.dumps(key)}: {text}" for key, text in _entries(model.outputs))
    return "{\n" + ",\n".join([*head, *body, f' "outputs": {{\n{outputs}\n }}']) + "\n}\n"


def parse_model(text: str, source: str) -> ReducedModel:
    """Return the model of a text.

    Args:
        text: As ``format_model`` writes it.
        source: Where it is from, for messages.

    Raises:
        ModelFileError: It is not such a text, or was changed.
    """
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ModelFileError(f"{source}: is damaged or cut: {error}") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        found = content.get("format") if isinstance(content, dict) else None
        raise ModelFileError(f"{source}: format {found!r}: expected {FORMAT!r}")
    try:
        outputs = Outputs(**_values(Outputs, content["outputs"]))
        model = ReducedModel(outputs=outputs, **_values(ReducedModel, content))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ModelFileError(f"{source}: is damaged: {error}") from None
    if content.get("model_id") != model.model_id:
        raise ModelFileError(
            f"{source}: was changed: it says model {content.get('model_id')} and holds {model.model_id}"
        )
    if format_model(model) != text:
        raise ModelFileError(f"{source}: was edited, though model {model.model_id} is in it; save it anew")
    return model


def _head(model_id: str) -> dict[str, str]:
    return dict(zip(_HEAD, (FORMAT, model_id), strict=True))


def _entries(holder: ReducedModel | Outputs) -> Iterator[tuple[str, str]]:
    """Yield name and text of every field but the outputs."""
    for field in fields(holder):
        value = getattr(holder, field.name)
        if isinstance(value, np.ndarray):
            yield field.name, _array_text(value)
        elif not isinstance(value, Outputs):
            yield field.name, json.dumps(value)


def _array_text(value: Any) -> str:
    """Return shape and values of an array, a line per row."""
    rows = value.tolist() if value.ndim > 1 else [value.tolist()]
    lines = ",\n".join(f"   {json.dumps(row)}" for row in rows)
    return f'{{"shape": {json.dumps(list(value.shape))}, "rows": [\n{lines}\n  ]}}'


def _values(kind: type, content: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments of a dataclass out of the file's content.

    Raises:
        KeyError: An entry is missing.
        ValueError: There is one too many, or rows do not fill their shape with finite numbers.
    """
    names = [field.name for field in fields(kind) if field.name != "outputs"]
    unknown = set(content) - set(names) - set(_HEAD) - {"outputs"}
    if unknown:
        raise ValueError(f"unknown entry {', '.join(sorted(unknown))}")
    return {name: _value(name, content[name]) for name in names}


def _value(name: str, entry: Any) -> Any:
    if isinstance(entry, dict):
        array = np.array(entry["rows"], dtype=np.float64).reshape(entry["shape"])
        if not np.isfinite(array).all():
            raise ValueError(f"{name} is not finite")
        return array
    return tuple(entry) if isinstance(entry, list) else entry
