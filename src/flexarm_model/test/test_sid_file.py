"""Standard input data: written and read back bit for bit, and read as another program means it."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from arms import bar, tip_mass
from fe_bodies import bracket, load_body
from numpy.typing import NDArray

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.sid_file import read_sid, write_sid
from flexarm_model.bodies.sid_terms import sid_matrices
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.body_spec import Reduction, RigidBody
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]


def rigid() -> Superelement:
    inertia = np.array([[0.03, 0.001, 0.002], [0.001, 0.04, 0.003], [0.002, 0.003, 0.05]])
    body = RigidBody(
        "hub", 1.7, np.array([0.1, -0.2, 0.3]), inertia, {"root": np.zeros(3), "far": np.ones(3)}
    )
    return reduce_body(body, {"root"})


def beam() -> Superelement:
    body = bar(("bend_y", "bend_z", "torsion", "stretch"), point_masses=tip_mass(0.2), damping_ratio=0.01)
    return reduce_body(replace(body, reduction=Reduction("craig_bampton", 6, "clamped")), {"root"})


@pytest.fixture(params=["rigid", "beam", "imported"])
def body(request: pytest.FixtureRequest, tmp_path: Path) -> Superelement:
    if request.param == "imported":
        return reduce_body(load_body(tmp_path, bracket(), damping_ratio="1 %"), {"root", "end"})
    return {"rigid": rigid, "beam": beam}[request.param]()


def same(a: Array, b: Array) -> bool:
    return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()


def foreign(body: Superelement, path: Path) -> Superelement:
    """Return the body as a file without flexarm's own block gives it."""
    write_sid(body, path)
    part = path.read_text(encoding="utf-8").partition("\nflexarm\n")[0]
    path.write_text(part + "\n", encoding="utf-8")
    return read_sid(path)


def test_a_superelement_comes_back_bit_for_bit(body: Superelement, tmp_path: Path) -> None:
    write_sid(body, str(tmp_path / "body.sid"))
    back = read_sid(str(tmp_path / "body.sid"))
    assert back.name == body.name and back.mass == body.mass and back.damping_ratio == body.damping_ratio
    for item in ("s", "P", "omega", "K", "D", "own_damping"):
        assert same(np.ascontiguousarray(getattr(back, item)), np.ascontiguousarray(getattr(body, item))), (
            item
        )
    assert list(back.nodes) == list(body.nodes)
    for name, node in body.nodes.items():
        for item in fields(node):
            a, b = (np.ascontiguousarray(getattr(each.nodes[name], item.name)) for each in (back, body))
            assert a.shape == b.shape and np.array_equal(a, b, equal_nan=True), (name, item.name)


def test_a_file_written_twice_is_the_same(body: Superelement, tmp_path: Path) -> None:
    for name in ("a.sid", "b.sid"):
        write_sid(body, tmp_path / name)
        body = read_sid(tmp_path / name)
    assert (tmp_path / "a.sid").read_bytes() == (tmp_path / "b.sid").read_bytes()


def test_a_mass_of_numpy_is_written_as_a_number(tmp_path: Path) -> None:
    """It was written as np.float64(...), which no program reads."""
    write_sid(replace(rigid(), mass=np.float64(1.7)), tmp_path / "a.sid")
    assert read_sid(tmp_path / "a.sid").mass == 1.7


def test_a_body_without_stiffening_needs_no_block_of_our_own(tmp_path: Path) -> None:
    body = reduce_body(load_body(tmp_path, bracket()), {"root", "end"})
    back = foreign(body, tmp_path / "body.sid")
    assert back.name == "body" and back.omega == pytest.approx(body.omega, rel=1e-9)
    assert same(back.s, body.s) and pytest.approx(body.P, abs=1e-12) == back.P


def test_stiffening_survives_a_foreign_file(tmp_path: Path) -> None:
    """All standard matrices come back, also through a body that splits them in another way."""
    body = beam()
    back = foreign(body, tmp_path / "body.sid")
    assert back.pairs == body.pairs and back.s == pytest.approx(body.s, abs=1e-15)
    for name, matrix in sid_matrices(back).items():
        expected = sid_matrices(body)[name]
        assert matrix.m0 == pytest.approx(expected.m0, abs=1e-11 * max(abs(expected.m0).max(), 1)), name
        assert (matrix.m1 is None) == (expected.m1 is None)
        if matrix.m1 is not None and expected.m1 is not None:
            assert matrix.m1 == pytest.approx(expected.m1, abs=1e-12), name


def cloud(body: Superelement, q: Array) -> tuple[Array, Array, Array]:
    """Return points whose integrals are the body's: masses, positions at q, derivatives over q."""
    n, rng = body.n, np.random.default_rng(9)
    dm, r, phi = rng.uniform(1, 2, 40), rng.standard_normal((40, 3)), rng.standard_normal((n, 40, 3))
    g = rng.standard_normal((n, n, 40, 3))
    g = (g + g.transpose(1, 0, 2, 3)) / 2
    c = r + np.einsum("iak,i->ak", phi, q) + np.einsum("ijak,i,j->ak", g, q, q) / 2
    return dm, c, phi + np.einsum("ijak,j->iak", g, q)


def point_body(n: int) -> Superelement:
    """Return the superelement of ``cloud``."""
    empty = replace(rigid(), omega=np.ones(n))
    dm, r, phi = cloud(empty, np.zeros(n))
    e = np.eye(n)
    bends = [(i, j) for i in range(n) for j in range(i, n)]
    g = [cloud(empty, e[j])[2][i] - phi[i] for i, j in bends]
    N = np.stack([r, *phi, *g])
    s, P = np.einsum("aki,k->ai", N, dm), np.einsum("aki,bkj,k->abij", N, N, dm)
    return Superelement("cloud", float(dm.sum()), s, P, np.ones(n), np.eye(n), np.zeros((n, n)), {})


def test_matrices_are_what_the_standard_says_they_are() -> None:
    """Against sums over points that move as the fields say: values at rest and slopes over q."""
    n = 3
    body, step = point_body(n), 1e-5
    omega = np.array([0.3, -0.5, 0.7])
    squares = np.array([*omega**2, omega[0] * omega[1], omega[1] * omega[2], omega[0] * omega[2]])
    spin = np.cross(np.eye(3), omega).T

    def sums(q: Array) -> dict[str, Array]:
        dm, c, dc = cloud(body, q)
        skews = [np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) for x, y, z in c]
        lean = [[np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) for x, y, z in each] for each in dc]
        return {
            "mdCM": (dm @ c)[:, None],
            "Ct": np.einsum("a,iak->ik", dm, dc),
            "Cr": np.einsum("a,iak->ik", dm, np.cross(c[None], dc)),
            "Gr": np.hstack(
                [-2 * sum(m * a @ b for m, a, b in zip(dm, skews, lean[j], strict=True)) for j in range(n)]
            ),
            "Oe": np.einsum("a,iak,kl,al->i", dm, dc, spin @ spin, c)[:, None],
        }

    matrices = sid_matrices(body)
    for name, at_rest in sums(np.zeros(n)).items():
        m0, m1 = matrices[name].m0, matrices[name].m1
        assert m1 is not None
        if name == "Oe":
            m0, m1 = (m0 @ squares)[:, None], np.einsum("iaj,a->ij", m1, squares)[:, None]
        assert m0 == pytest.approx(at_rest, rel=1e-9, abs=1e-9), name
        slope = [(sums(step * e)[name] - sums(-step * e)[name]) / (2 * step) for e in np.eye(n)]
        assert m1 == pytest.approx(np.stack(slope, axis=2), rel=1e-7, abs=1e-7), name
    dm, _, phi = cloud(body, np.zeros(n))
    for i in range(n):
        for j in range(n):
            gyroscopic = 2 * dm @ np.cross(phi[j], phi[i])
            assert matrices["Ge"].m0[i, 3 * j : 3 * j + 3] == pytest.approx(gyroscopic, abs=1e-9)
            assert matrices["Me"].m0[i, j] == pytest.approx(dm @ (phi[i] * phi[j]).sum(axis=1))


FOREIGN = """
! comment
part
  new modal
    refmod
      mass = 2.0D+00
      nelastq = 1
      ielastq( 1) = first bending
    end refmod
    frame
      new node = 1
        rframe = body ref
        origin
          order = 0
          nrow = 3
          ncol = 1
          nq = 1
          nqn = 0
          structure = 3
          m0( 1, 1) = 0.5
        end origin
      end node
    end frame
  end modal
end part
"""


def test_a_foreign_file_that_lacks_something_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "body.sid"
    for content, expected in (
        (FOREIGN, ("line 4: modal", "block 'mdCM' is missing", "refmod, frame")),
        (FOREIGN.replace("nelastq = 1", "nelastq = one"), ("line 5: refmod", "'one' is not a number")),
        (FOREIGN.replace("    end frame\n", ""), ("'end modal' closes no block",)),
        (FOREIGN.replace("end part\n", ""), ("part", "is not closed by 'end part'")),
        ("hello = 1\n", ("block 'part' is missing",)),
    ):
        path.write_text(content, encoding="utf-8")
        with pytest.raises(ConfigError) as caught:
            read_sid(path)
        for fragment in (str(path), *expected):
            assert fragment in str(caught.value)
    with pytest.raises(ConfigError, match="none.sid: cannot be read"):
        read_sid(tmp_path / "none.sid")


def test_wrong_matrices_are_refused_by_line(tmp_path: Path) -> None:
    path = tmp_path / "body.sid"
    back = foreign(rigid(), path)
    assert back.mass == 1.7 and same(back.s, rigid().s) and pytest.approx(rigid().P, abs=1e-15) == back.P
    text = path.read_text(encoding="utf-8")
    for old, new, expected in (
        ("mdCM\n  order = 1\n  nrow = 3", "mdCM\n  order = 1\n  nrow = 4", "mdCM: is 4 x 1; expected 3 x 1"),
        ("  m0( 1,  1) = 0.17", "  m0( 9,  1) = 0.17", r"mdCM: m0\(9, 1\): expected indices up to \(3, 1\)"),
        ("  m0( 1,  1) = 0.17", "  m0( 1,  1) = x", "mdCM: 'x"),
        ("AP\n  order = 1\n  nrow = 3\n  ncol = 3\n  nq = 0\n  nqn = 0\n  structure = 3\n  m0( 1,  1) = 1.0",
         "AP\n  order = 1\n  nrow = 3\n  ncol = 3\n  nq = 0\n  nqn = 0\n  structure = 3\n  m0( 1,  1) = -1.0",
         "AP: the node's axes must be those of the body"),
    ):  # fmt: skip
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
        with pytest.raises(ConfigError, match=expected):
            read_sid(path)


def test_an_edited_part_does_not_keep_the_old_block(tmp_path: Path) -> None:
    path = tmp_path / "body.sid"
    write_sid(beam(), path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("mass = ", "mass = 1", 1), encoding="utf-8")
    with pytest.raises(ConfigError, match="flexarm: the file was changed"):
        read_sid(path)


def test_symmetric_matrices_may_be_given_by_one_triangle(tmp_path: Path) -> None:
    path = tmp_path / "body.sid"
    write_sid(rigid(), path)
    part = path.read_text(encoding="utf-8").partition("\nflexarm\n")[0]
    before, rest = part.split("\nJ\n")
    inertia, after = rest.split("\nend J\n")
    lower = [
        line
        for line in inertia.splitlines()
        if not any(k in line for k in ("( 1,  2)", "( 1,  3)", "( 2,  3)"))
    ]
    block = "\n".join(lower).replace("structure = 3", "structure = 2")
    path.write_text(f"{before}\nJ\n{block}\nend J\n{after}\n", encoding="utf-8")
    assert pytest.approx(rigid().P, abs=1e-15) == read_sid(path).P
