"""Shared libraries of C code, kept from one start to the next.

The folder is ``$FLEXARM_CACHE`` (default: the user's cache folder). A library is named by the hash of its
C code, or of what that is generated from, of the compiler with its version and flags, and of the machine's
architecture. Its last bytes are the hash of all before them: one that a power cut or a full disk left in
pieces is built anew. It has to be found before it is opened, for opening a library without its end stops the
process (SIGBUS).
"""

from __future__ import annotations

import _ctypes
import hashlib
import logging
import os
import platform
import re
import shutil
import stat
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path

from flexarm_model.process.start_watch import takes_long

CACHE = "FLEXARM_CACHE"
FLAGS = ("-O1", "-fPIC", "-shared", "-ffp-contract=off")  # -O3 takes minutes and gains little
HEADER = Path(__file__).with_name("machine_code.h")  # what C files written by hand share
LONG_SOURCE = 1_000_000  # bytes of C; from here on compiling takes seconds, and is announced
OLD = 86_400.0  # s after which a folder of a build belongs to nobody any more
SEAL = 16  # bytes of the hash at a library's end
LOG = logging.getLogger("flexarm")


def cache_folder() -> Path:
    """Return the folder of the compiled code."""
    if chosen := os.environ.get(CACHE):
        return Path(chosen)
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        return Path(chosen) / "flexarm"
    try:
        return Path.home() / ".cache" / "flexarm"
    except RuntimeError:  # a user that nobody knows, as in a container
        return _private_folder(Path(tempfile.gettempdir()) / f"flexarm-cache-{os.getuid()}")


@cache
def _private_folder(folder: Path) -> Path:
    """Return this folder, or one of this process alone where somebody else could put code into it."""
    with suppress(OSError):
        folder.mkdir(mode=0o700, exist_ok=True)
        state = folder.lstat()
        if stat.S_ISDIR(state.st_mode) and state.st_uid == os.getuid() and not state.st_mode & 0o022:
            return folder
    return Path(tempfile.mkdtemp(prefix="flexarm-cache-"))


def build_library(source: Path, compiler: str, flags: tuple[str, ...] = FLAGS) -> Path | None:
    """Return the shared library of a C file, from the cache or new; see ``keep_library``."""
    return keep_library(_text(source), lambda _: source, compiler, flags)


def keep_library(
    identity: bytes, write: Callable[[Path], Path], compiler: str, flags: tuple[str, ...] = FLAGS
) -> Path | None:
    """Return the shared library of C code, from the cache or new.

    Args:
        identity: What the code is known by: itself, or what it is generated from.
        write: Writes the code, into the folder given or elsewhere, and returns its file; not called where
            the library is kept already.
        compiler: Path.
        flags: Of the compiler.

    Returns:
        Its path; None, with one line about why, where the compiler fails or the folder cannot be used.
    """
    try:
        maker = _maker(compiler)
    except OSError as error:
        tell(f"the C compiler {compiler} cannot be run: {error.strerror}; slower code runs instead")
        return None
    made_of = (identity, HEADER.read_bytes(), *(part.encode() for part in (*maker, *flags)))
    target = cache_folder() / f"{hashlib.sha256(bytes(1).join(made_of)).hexdigest()[:24]}.so"
    if _is_whole(target) and _opens(target):
        return target
    try:
        with tempfile.TemporaryDirectory() as folder:
            source = write(Path(folder))
            if source.stat().st_size > LONG_SOURCE:
                LOG.info("compiling %.1f MB of C; once, then it is kept", source.stat().st_size / 1e6)
            return _build([compiler, "-x", "c", str(source), f"-I{HEADER.parent}", *flags], target)
    except OSError as error:
        trouble = f"compiled code cannot be kept in {target.parent}: {error.strerror}"
        tell(f"{trouble}; slower code runs instead")
        return None


def _build(command: list[str], target: Path) -> Path | None:
    """Compile in a folder of its own beside the target: others, on other machines too, may build the same.

    Raises:
        OSError: The folder cannot be made or written to.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    for left in target.parent.glob("*.tmp"):  # by who was killed at it
        with suppress(OSError):
            if time.time() - left.stat().st_mtime > OLD:
                shutil.rmtree(left)
    with tempfile.TemporaryDirectory(prefix=f"{target.stem}.", suffix=".tmp", dir=target.parent) as folder:
        built = Path(folder) / target.name
        with takes_long():
            made = subprocess.run([*command, "-o", str(built), "-lm"], check=False, capture_output=True)
        if made.returncode:
            tell(f"the C compiler {command[0]} fails{_first_error(made.stderr)}; slower code runs instead")
            return None
        code = built.read_bytes()
        built.write_bytes(code + _seal(code))
        if not _opens(built):
            tell(f"code compiled into {target.parent} cannot be run from there; slower code runs instead")
            return None
        built.replace(target)  # atomic
    return target


def _first_error(stderr: bytes) -> str:
    """Return the compiler's first complaint with a colon before it; nothing where it has none."""
    lines = [line for line in stderr.decode(errors="replace").splitlines() if "error" in line]
    return f": {lines[0]}" if lines else ""


def _is_whole(library: Path) -> bool:
    """Whether a library is there and ends with the hash of what it holds."""
    try:
        content = library.read_bytes()
    except OSError:
        return False
    return content[-SEAL:] == _seal(content[:-SEAL])


def _opens(library: Path) -> bool:
    """Whether this machine can load a library: not one made for another C library, or in a folder noexec."""
    try:
        handle = _ctypes.dlopen(str(library), os.RTLD_NOW)
    except OSError:
        return False
    _ctypes.dlclose(handle)
    return True


def _seal(code: bytes) -> bytes:
    """Return the hash that a library ends with."""
    return hashlib.blake2b(code, digest_size=SEAL).digest()


@cache
def _maker(compiler: str) -> tuple[str, str, str]:
    """Return what tells compilers apart: path, version, architecture."""
    told = subprocess.run([compiler, "--version"], check=False, capture_output=True)
    return compiler, told.stdout.decode(errors="replace"), platform.machine()


@cache
def tell(trouble: str) -> None:
    """Log a trouble once."""
    LOG.warning("%s", trouble)


def _text(source: Path) -> bytes:
    """Return a C file and the headers beside it that it names."""
    text = source.read_bytes()
    named = (source.parent / name.decode() for name in re.findall(rb'#include "([^"]+)"', text))
    return text + b"".join(header.read_bytes() for header in named if header.exists())
