"""What options of the command line may hold: numbers within a range, files that can be written.

Each function makes, or is, a ``type`` for ``argparse``, so that a wrong value is refused with the option's
name and what is allowed before anything is computed.
"""

from __future__ import annotations

import math
import os
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Iterable
from pathlib import Path

STDOUT = Path("-")  # as the name of a file
REPORTS = ("json", "html")  # options of every report
FILES = (*REPORTS, "csv", "save", "update", "retune")  # options that name a file to write


def number(
    *, above: float = -math.inf, at_least: float = -math.inf, at_most: float = math.inf
) -> Callable[[str], float]:
    """Return a type of finite numbers within a range."""

    def read(text: str) -> float:
        """Return the number; ArgumentTypeError when it is none that is allowed."""
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value > above and at_least <= value <= at_most):
            raise ArgumentTypeError(f"'{text}': expected a number{_range(above, at_least, at_most)}")
        return value

    return read


def whole(*, at_least: int, at_most: float = math.inf) -> Callable[[str], int]:
    """Return a type of whole numbers within a range."""

    def read(text: str) -> int:
        """Return the number; ArgumentTypeError when it is none that is allowed."""
        try:
            value = int(text)
        except ValueError:
            value = at_least - 1
        if not at_least <= value <= at_most:
            most = f", at most {at_most}" if at_most < math.inf else ""
            raise ArgumentTypeError(f"'{text}': expected a whole number, at least {at_least}{most}")
        return value

    return read


def add_seed(parser: ArgumentParser, of: str, default: int = 1) -> None:
    """Add --seed: ``of`` says what is random."""
    parser.add_argument(
        "--seed", type=whole(at_least=0), default=default, metavar="N", help=f"of {of} (default {default})"
    )


def output_file(text: str) -> Path:
    """Return the path of a file that can be written; "-" is the standard output.

    Raises:
        ArgumentTypeError: It cannot be written; says why.
    """
    path = Path(text)
    if path == STDOUT or (path.exists() and not path.is_file() and not path.is_dir()):  # a device, a pipe
        return path
    is_there = path.exists()
    try:
        path.open("ab").close()
    except OSError as error:
        raise ArgumentTypeError(f"'{text}': cannot be written ({error.strerror})") from None
    if not is_there:
        path.unlink()
    return path


def named_file(text: str) -> Path:
    """Return the path of a file that can be written and read again by its name, so not "-".

    Raises:
        ArgumentTypeError: It cannot be written, or is the standard output, a device or a pipe.
    """
    if Path(text) == STDOUT:
        raise ArgumentTypeError(f"'{text}': expected the name of a file, not the standard output")
    if Path(text).exists() and not Path(text).is_file() and not Path(text).is_dir():
        raise ArgumentTypeError(f"'{text}': expected a file that can be read again, not a device or a pipe")
    return output_file(text)


def output_folder(text: str) -> Path:
    """Return the path of a folder that is there or can be made; trying it leaves nothing behind.

    Who writes into it makes it then: a command that is refused leaves no empty folder.

    Raises:
        ArgumentTypeError: It cannot be made; says why.
    """
    path = Path(text)
    missing = [part for part in (path, *path.parents) if not part.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ArgumentTypeError(f"'{text}': cannot be made a folder ({error.strerror})") from None
    finally:
        for part in missing:
            if part.is_dir():
                part.rmdir()
    return path


def new_folder(text: str) -> Path:
    """Return the path of a folder that is not there yet and can be made; trying it leaves nothing behind.

    Raises:
        ArgumentTypeError: It is there already, or cannot be made; says why.
    """
    if Path(text).exists():
        raise ArgumentTypeError(f"'{text}': exists already")
    return output_folder(text)


def folder(text: str) -> Path:
    """Return the path of a folder that is there; ArgumentTypeError when it is not."""
    path = Path(text)
    if not path.is_dir():
        raise ArgumentTypeError(f"'{text}': no such folder")
    return path


def refuse_idle(
    args: Namespace, add_arguments: Callable[[ArgumentParser], None], options: Iterable[str], why: str
) -> None:
    """Refuse options that were given and would change nothing.

    Args:
        args: What was given.
        add_arguments: Declares the options of the command, with their defaults.
        options: Those that are of no use here, "--until".
        why: What they go with, or not with.

    Raises:
        ValueError: One of them is not as by default; names it.
    """
    parser = ArgumentParser(add_help=False)
    add_arguments(parser)
    places = {option: option.removeprefix("--").replace("-", "_") for option in options}
    defaults = {option: parser.get_default(place) for option, place in places.items()}
    idle = [
        option
        for option, place in places.items()
        if getattr(args, place, None) not in (None, defaults[option])
    ]
    if idle:
        raise ValueError(f"{', '.join(idle)}: {why}")


def shared_file(args: Namespace) -> str:
    """Return which two options of a report or a result name one file; empty when each has its own."""
    places: dict[Path, str] = {}
    for option in FILES:
        path = getattr(args, option, None)
        if not isinstance(path, Path) or path == Path() or (path.exists() and not path.is_file()):
            continue  # none, one by default, or a device
        if path == STDOUT and option not in REPORTS:
            continue  # refused by whoever may write there, with what goes beside it
        place = path if path == STDOUT else path.resolve()
        if place in places:
            named = "the standard output" if path == STDOUT else str(path)
            return f"--{places[place]} and --{option} are one file, {named}; expected one for each"
        places[place] = option
    return ""


def overwritten_file(args: Namespace) -> str:
    """Return which option of a report or a result names a file that is read; empty when none does."""
    for option in FILES:
        path = getattr(args, option, None)
        if not isinstance(path, Path) or not path.is_file():
            continue
        for key, value in vars(args).items():
            given = value if isinstance(value, list | tuple) else [value]
            named = [str(each) for each in given if isinstance(each, str | Path) and key not in FILES]
            if any(os.path.isfile(each) and os.path.samefile(each, path) for each in named):
                return f"--{option} would overwrite {path}, which is read; expected another file"
    return ""


def _range(above: float, at_least: float, at_most: float) -> str:
    """Return a range in words, each with the comma before it."""
    words = [(above, "above"), (at_least, "at least"), (at_most, "at most")]
    return "".join(f", {word} {limit:g}" for limit, word in words if math.isfinite(limit))
