"""Compiled code and CasADi's virtual machine give the same numbers; the cache is used and can be trusted."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from arms import arm, random_states, tree

from flexarm_model.numeric import library_cache
from flexarm_model.numeric.compiled import FastFunction, compile_functions, find_compiler
from flexarm_model.numeric.library_cache import cache_folder
from flexarm_model.tree.reduced_tree import ReducedTree

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FLEXARM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def example(factor: float = 2.0) -> dict[str, ca.Function]:
    x, y = ca.SX.sym("x", 3), ca.SX.sym("y")
    sparse = ca.SX(3, 2)
    sparse[1, 0] = factor * x[0] * y
    return {"f": ca.Function("f", [x, y], [sparse, ca.sin(x)]), "g": ca.Function("g", [y], [factor * y])}


@needs_compiler
def test_compiled_equals_virtual_machine(cache: Path) -> None:
    fast, slow = ReducedTree(arm("single_link")).functions, tree("single_link").functions
    for q, v, a in random_states(tree("single_link"), 20):
        arguments = {
            "inverse_dynamics": (q, v, a), "mass_matrix": (q,), "bias": (q, v), "forward_dynamics": (q, v, a),
            "stiffness": (q,), "outputs": (q, v, a, q), "output_rows": (q,),
            "motion": (q, v), "tip_pose": (q,), "tip_jacobian": (q,),
        }  # fmt: skip
        assert set(arguments) == set(fast)
        for name, inputs in arguments.items():
            ours, theirs = fast[name](*inputs), slow[name](*inputs)
            for one, other in zip(ours, theirs, strict=True):
                assert one == pytest.approx(np.array(other), rel=1e-12, abs=1e-12)


@needs_compiler
def test_a_second_start_generates_and_compiles_nothing(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_functions(example())
    assert len(list(cache.glob("*.so"))) == 1 and not list(cache.glob("*.tmp"))

    def refuse(*_: Any, **__: Any) -> None:
        raise AssertionError("the compiler ran, or code was generated for it")

    monkeypatch.setattr(subprocess, "run", refuse)
    monkeypatch.setattr(ca, "CodeGenerator", refuse)
    assert compile_functions(example())["g"](3.0)[0] == 6.0


@needs_compiler
def test_other_content_is_other_code(cache: Path) -> None:
    assert compile_functions(example(2.0))["g"](3.0)[0] == 6.0
    assert compile_functions(example(4.0))["g"](3.0)[0] == 12.0
    assert len(list(cache.glob("*.so"))) == 2


def test_without_a_compiler_the_virtual_machine_answers(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert compile_functions(example())["g"](3.0)[0] == 6.0
    assert not cache.exists()


def test_results_are_shaped_as_the_function_says() -> None:
    matrix, vector = compile_functions(example(), use_compiler=False)["f"](np.array([1.0, 2.0, 3.0]), 5.0)
    assert matrix.shape == (3, 2) and vector.shape == (3,)
    assert np.array_equal(matrix, [[0, 0], [10, 0], [0, 0]])
    assert vector == pytest.approx(np.sin([1.0, 2.0, 3.0]))


def test_a_column_is_a_vector_unless_it_is_said_to_be_a_matrix() -> None:
    x = ca.SX.sym("x", 2)
    columns = {"columns": ca.Function("columns", [x], [x, 2 * x])}
    for how in (False, True):
        vector, matrix = compile_functions(columns, how, {"columns": (1,)})["columns"](np.array([1.0, 2.0]))
        assert vector.shape == (2,) and np.array_equal(matrix, [[2.0], [4.0]])


def test_a_matrix_input_goes_in_as_it_stands() -> None:
    A = ca.SX.sym("A", 2, 3)
    given = np.arange(6.0).reshape(2, 3)
    assert np.array_equal(FastFunction(ca.Function("h", [A], [A.T]))(given), given.T)


def test_results_are_views_that_the_next_call_overwrites() -> None:
    g = compile_functions(example(), use_compiler=False)["g"]
    first = g(1.0)
    g(5.0)
    assert first[0] == 10.0


def test_a_missing_argument_is_refused() -> None:
    with pytest.raises(ValueError, match="zip"):
        compile_functions(example(), use_compiler=False)["f"](np.zeros(3))


def test_the_cache_lies_where_the_user_says(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("FLEXARM_CACHE", raising=False)
    assert cache_folder() == tmp_path / "flexarm"
    monkeypatch.setenv("FLEXARM_CACHE", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own"


def test_a_user_whom_nobody_knows_has_a_cache_of_his_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """In a container with --user 54321: "Could not determine home directory"."""

    def unknown() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("FLEXARM_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", unknown)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    found = cache_folder()
    assert found == tmp_path / f"flexarm-cache-{os.getuid()}" and found.stat().st_mode & 0o777 == 0o700
    found.chmod(0o777)  # others could put their code there
    library_cache._private_folder.cache_clear()
    assert (other := cache_folder()) != found and other.parent == tmp_path
    assert other.stat().st_mode & 0o777 == 0o700
    library_cache._private_folder.cache_clear()
