"""Damaged MATLAB files are refused by name; some of them ended the process, so others read them here."""

from __future__ import annotations

import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import io, sparse

from flexarm_model.fe_import.matlab_file import read_variables
from flexarm_model.settings.strict_yaml import ConfigError

A = np.array([[2.0, 1.0], [1.0, 3.0]])
READ = """
import sys
from pathlib import Path
from flexarm_model.fe_import.matrix_file import read_matrix
from flexarm_model.manipulator.imported_body import MatrixFile
from flexarm_model.settings.strict_yaml import ConfigError
for name in sys.argv[1:]:
    try:
        print(read_matrix(MatrixFile(Path(name), "")).shape)
    except ConfigError as error:
        print(" ".join(str(error).split()))
"""


def read_elsewhere(*paths: Path) -> list[str]:
    command = [sys.executable, "-c", READ, *map(str, paths)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def written(path: Path, matrix: object, **options: object) -> bytes:
    io.savemat(path, {"A": matrix}, **options)
    return path.read_bytes()


@pytest.mark.parametrize("format_", ["4", "5"])
@pytest.mark.parametrize("matrix", [A, sparse.csc_matrix(A)], ids=["full", "sparse"])
def test_sound_files_are_read(matrix: object, format_: str, tmp_path: Path) -> None:
    written(tmp_path / "a.mat", matrix, format=format_)
    value = read_variables(tmp_path / "a.mat")["A"]
    assert np.array_equal(value.toarray() if sparse.issparse(value) else value, A)


def test_what_else_is_in_a_file_does_not_matter(tmp_path: Path) -> None:
    others = {
        "text": "a note",
        "cell": np.array([A, "x"], dtype=object),
        "record": {"a": {"b": 1.0}, "c": [1]},
    }
    for do_compression in (False, True):
        io.savemat(tmp_path / "a.mat", {"A": A, **others}, do_compression=do_compression)
        assert np.array_equal(read_variables(tmp_path / "a.mat")["A"], A)


def test_an_entry_outside_of_a_sparse_matrix_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    raw = bytearray(written(path, sparse.csc_matrix(np.ones((2, 2)))))
    rows = raw.index(struct.pack("<4i", 0, 1, 0, 1))
    raw[rows + 4 : rows + 8] = struct.pack("<i", 2**30)
    path.write_bytes(raw)
    (line,) = read_elsewhere(path)
    assert str(path) in line and "damaged" in line


def test_a_type_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    raw = bytearray(written(path, A))
    numbers = raw.index(struct.pack("<2I", 9, 32))  # four doubles
    raw[numbers : numbers + 4] = struct.pack("<I", 60000)
    path.write_bytes(raw)
    (line,) = read_elsewhere(path)
    assert str(path) in line and "type 60000" in line


def test_no_damage_ends_the_process_or_goes_unnamed(tmp_path: Path) -> None:
    rng, paths = np.random.default_rng(0), []
    wide = sparse.random(20, 20, 0.3, rng=rng).tocsc()
    for kind, matrix in (("full", wide.toarray()), ("sparse", wide)):
        for how, options in (("plain", {}), ("packed", {"do_compression": True}), ("old", {"format": "4"})):
            raw = written(tmp_path / "sound.mat", matrix, **options)
            for k in range(100):
                damaged = bytearray(raw[: rng.integers(1, len(raw))] if k % 3 == 0 else raw)
                for place in rng.integers(0, min(len(damaged), 400), 3 * (k % 3 > 0)):
                    damaged[place] = rng.integers(256)
                paths.append(tmp_path / f"{kind}_{how}_{k}.mat")
                paths[-1].write_bytes(damaged)
    lines = read_elsewhere(*paths)
    assert len(lines) == len(paths)
    refused = [(path, line) for path, line in zip(paths, lines, strict=True) if line != "(20, 20)"]
    assert len(refused) > len(paths) / 2 and all(line.startswith(str(path)) for path, line in refused)


def test_a_file_of_version_7_3_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + b"\x89HDF")
    with pytest.raises(ConfigError, match=r"a.mat: .* version 4 to 7.2: it is of version 7.3; .*'-v7'"):
        read_variables(path)
