"""A fitted description written as a new file: the old one with its new values, and where they come from."""

from __future__ import annotations

import datetime
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from flexarm_bringup.bags.described_arm import KEYS
from flexarm_bringup.identify.fingerprint import fingerprint
from flexarm_bringup.identify.line_ends import with_line_ends_of
from flexarm_bringup.identify.updating import PERCENT, Fitting
from flexarm_bringup.whole_file import written_whole
from flexarm_model.identification.model_update import Update
from flexarm_model.identification.unknown import Unknown, changed
from flexarm_model.identification.yaml_edit import add_items, edit_names, edit_values
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree


def write_description(fitting: Fitting, update: Update, sources: Sequence[Path]) -> str:
    """Write the new description and return what was done, in a sentence.

    Args:
        fitting: What was fitted, and the file to write.
        update: How it came about.
        sources: Files and folders of bags that it rests on, of all poses.

    Raises:
        ValueError: The data told nothing, or the new file is not a valid description.
        OSError: A source cannot be read, or the file not be written.
    """
    if fitting.output is None:
        return ""
    if not update.changes:
        raise ValueError("the data tell none of the parameters: there is nothing to write")
    path = find_manipulator(fitting.manipulator)
    rests_on = [_provenance(update, name, sources) for name in update.changes]
    text = _new_text(path, fitting.preset, update.changes, rests_on, fitting.output)
    old = load_config(path, fitting.preset)
    with written_whole(fitting.output, text) as written:
        new = load_config(written, fitting.preset)
        ids = [linearize(ReducedTree(config, use_compiler=False)).model_id for config in (new, old)]
    return f"wrote {fitting.output}: model {ids[0]} at home, was {ids[1]}; config {new.config_id}"


def refuse_unwritable(manipulator: str, preset: str, unknowns: Sequence[Unknown]) -> None:
    """Refuse a description in which the parameters cannot be changed, or nothing be added: before a test.

    Raises:
        ConfigError: Of its values, or of the list of what was fitted; names the file.
    """
    path = find_manipulator(manipulator)
    try:
        _new_text(path, preset, changed(unknowns, np.ones(len(unknowns))), ["one more"], None)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def _new_text(
    path: Path, preset: str, changes: Mapping[str, str | float], rests_on: Sequence[str], output: Path | None
) -> str:
    """Return the text of a description with new values, for a file somewhere else; lines keep their ends."""
    with path.open(encoding="utf-8", newline="") as file:
        as_it_is = file.read()
    text = edit_values(path.read_text(encoding="utf-8"), changes, preset)
    text = edit_names(text, KEYS, lambda name: _seen_from(output, path, name))
    return with_line_ends_of(as_it_is, add_items(text, "fitted", rests_on))


def _seen_from(output: Path | None, description: Path, name: str) -> str:
    """Return how a file that a description names is named in another one."""
    here, there = description.resolve().parent, (output or description).absolute().parent.resolve()
    if here == there or Path(name).is_absolute():
        return name
    return os.path.relpath(here / name, there)


def _provenance(update: Update, name: str, sources: Sequence[Path]) -> str:
    i = next(k for k, unknown in enumerate(update.unknowns) if name in unknown.paths)
    unknown = update.unknowns[i]
    files = ", ".join(f"{path.name} (sha256 {fingerprint(path)})" for path in sources)
    alike = ", as one with its equal parts" if unknown.equals else ""
    today = datetime.date.today().isoformat()
    return (
        f"{name} = {update.changes[name]} +- {PERCENT * update.sigma[i]:.2g} % "
        f"(was {unknown.text(0.0)}){alike}, on modes identified from {files}, {today}"
    )
