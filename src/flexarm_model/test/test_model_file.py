"""A model comes out of its file bit for bit, or not at all."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from arms import tree

from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_file import FORMAT, ModelFileError, format_model, load_model, save_model
from flexarm_model.served.reduced_model import ReducedModel


@cache
def model(name: str = "single_link") -> ReducedModel:
    return linearize(tree(name))


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "model.json"
    save_model(model(), path)
    return path


@pytest.mark.parametrize("name", ["single_link", "planar", "spatial", "spatial_rigid"])
def test_a_model_comes_back_bit_for_bit(name: str, tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    save_model(model(name), path)
    again = load_model(path)
    assert again.model_id == model(name).model_id
    for a, b in ((again, model(name)), (again.outputs, model(name).outputs)):
        for field in fields(a):
            x, y = getattr(a, field.name), getattr(b, field.name)
            if isinstance(x, np.ndarray):
                assert x.shape == y.shape and x.tobytes() == np.ascontiguousarray(y).tobytes()
                assert not x.flags.writeable
            elif field.name != "outputs":
                assert x == y and type(x) is type(y)


def test_a_path_may_be_text_and_what_comes_back_is_equal(tmp_path: Path) -> None:
    save_model(model(), f"{tmp_path}/model.json")
    again = load_model(f"{tmp_path}/model.json")
    assert again == model() and len({again, model()}) == 1 and again in (model("planar"), model())
    assert again != model("planar") and again != again.model_id
    assert replace(model(), f0=model().f0 + 1e-16) != model()


def test_where_nothing_can_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"nowhere/model.json: cannot be written \(No such file"):
        save_model(model(), tmp_path / "nowhere" / "model.json")
    (tmp_path / "folder").mkdir()
    with pytest.raises(ModelFileError, match="folder: cannot be written"):
        save_model(model(), tmp_path / "folder")
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def test_extreme_numbers_survive(tmp_path: Path) -> None:
    hard = np.array([-0.0, 5e-324, 0.1 + 0.2, np.nextafter(1.0, 2.0), -1.7976931348623157e308])
    path = tmp_path / "model.json"
    save_model(replace(model(), q0=hard), path)
    assert load_model(path).q0.tobytes() == hard.tobytes()


def test_a_number_that_is_not_one_is_not_saved(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    with pytest.raises(ModelFileError, match="zeta is not finite"):
        save_model(replace(model(), zeta=np.full(3, np.nan)), path)
    with pytest.raises(ModelFileError, match="was changed"):  # float32 would come back as float64
        save_model(replace(model(), zeta=np.full(3, 0.1, dtype=np.float32)), path)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_a_changed_value_is_refused_with_both_ids(saved: Path) -> None:
    other = replace(model(), zeta=2 * model().zeta)
    saved.write_text(format_model(other).replace(other.model_id, model().model_id))
    with pytest.raises(ModelFileError) as error:
        load_model(saved)
    assert all(text in str(error.value) for text in (str(saved), model().model_id, other.model_id))


def test_a_flipped_bit_is_refused_wherever_it_is(saved: Path) -> None:
    content = saved.read_bytes()
    rng = np.random.default_rng(1)
    for at in rng.choice(len(content), 300, replace=False):
        damaged = bytearray(content)
        damaged[at] ^= 1 << int(rng.integers(8))
        saved.write_bytes(damaged)
        with pytest.raises(ModelFileError, match=str(saved)):
            load_model(saved)


def test_a_cut_file_is_refused_wherever_it_ends(saved: Path) -> None:
    content = saved.read_bytes()
    for end in [*range(0, len(content) - 1, 997), len(content) - 1]:
        saved.write_bytes(content[:end])
        with pytest.raises(ModelFileError, match=str(saved)):
            load_model(saved)


def test_another_version_and_a_missing_file_are_refused_by_name(saved: Path) -> None:
    saved.write_text(saved.read_text().replace(FORMAT, "flexarm-model/2"))
    with pytest.raises(ModelFileError, match=r"'flexarm-model/2': expected 'flexarm-model/1'"):
        load_model(saved)
    with pytest.raises(ModelFileError, match="none.json: cannot be read"):
        load_model(saved.with_name("none.json"))


def test_unknown_and_missing_entries_are_named(saved: Path) -> None:
    text = saved.read_text()
    saved.write_text(text.replace('"zeta"', '"zetas"'))
    with pytest.raises(ModelFileError, match="unknown entry zetas"):
        load_model(saved)
    for content in (
        "[]",
        "{}",
        "null",
        '"text"',
        f'{{"format": "{FORMAT}"}}',
        f'{{"format": "{FORMAT}", "outputs": 3}}',
    ):
        saved.write_text(content)
        with pytest.raises(ModelFileError):
            load_model(saved)
