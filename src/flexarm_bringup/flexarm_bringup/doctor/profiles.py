"""The files of profiles that the user gives Fast DDS: flexarm leaves its own settings out for them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.parsers import expat

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.processes.surroundings import PROFILE_VARIABLES
from flexarm_model.reading.share import share_folders

SUBJECT = "profiles"
ROOTS = ("dds", "profiles", "types", "log", "library_settings")  # that Fast DDS 2.14 reads, as tried
_OFF = "flexarm leaves its own settings of the middleware out for it"


def look_at_profiles(environment: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    """Yield every variable that names a file of the user's, and whether Fast DDS can read that file."""
    for name in PROFILE_VARIABLES:
        value = environment.get(name)
        if not value or _is_our_own(Path(value)):
            continue
        if reason := find_unreadable(Path(value)):
            text, cure = (
                f"{name}: '{value}': {reason}, and {_OFF}",
                f"unset {name}, or name a file of profiles",
            )
            yield Finding("FAULT", SUBJECT, text, cure)
        else:
            text = f"{name}: '{value}': {_OFF}"
            yield Finding("hint", SUBJECT, text, f"right where you mean it, else unset {name}")


def find_unreadable(path: Path) -> str:
    """Return why Fast DDS reads no profiles of a file; empty where it is XML that begins as those do."""
    if not path.is_file():
        return "no such file"
    roots: list[str] = []

    def note(name: str, _: Mapping[str, str]) -> None:
        """Keep the name of the first element."""
        if not roots:
            roots.append(name)

    parser = expat.ParserCreate()  # without name spaces, as Fast DDS reads it
    parser.StartElementHandler = note
    try:
        parser.Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        return f"it is no XML ({error})"
    except OSError as error:
        return f"it cannot be read ({error.strerror})"
    return "" if roots[0] in ROOTS else f"it begins with <{roots[0]}>, expected <{'>, <'.join(ROOTS)}>"


def _is_our_own(path: Path) -> bool:
    """Say whether a file comes with flexarm: who starts nodes by hand names it."""
    folders = [(share / "config" / "middleware").resolve() for share in share_folders("flexarm_bringup")]
    return path.is_file() and path.resolve().parent in folders
