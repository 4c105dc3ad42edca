"""Sums over the second moments of a body, in expressions that are quick to make."""

from __future__ import annotations

import sys
from collections import Counter

import casadi as ca
import numpy as np

from flexarm_model.bodies.superelement import Superelement, pairs
from flexarm_model.tree import elastic_forces
from flexarm_model.tree.frames import Motion


def body(n: int) -> Superelement:
    """Return a body of n modes with second-order fields, of random moments, a third of them zero."""
    rng = np.random.default_rng(n)
    n_f = 1 + n + len(pairs(n))
    s = rng.standard_normal((n_f, 3))
    P = rng.standard_normal((n_f, n_f, 3, 3)) * (rng.random((n_f, n_f, 3, 3)) > 1 / 3)
    return Superelement("body", 2.0, s, P, np.arange(1.0, n + 1), np.eye(n), np.zeros((n, n)), {})


def test_moments_are_summed_over_the_first_field() -> None:
    one = body(3)
    U = ca.SX.sym("U", one.s.shape[0], 2)
    sums = ca.Function("sums", [U], [part for column in elastic_forces._contract(one, U) for part in column])
    u = np.random.default_rng(1).standard_normal(U.shape)
    expected = np.einsum("ak,abij->kbij", u, one.P).reshape(-1, 3, 3)
    np.testing.assert_allclose([np.array(part) for part in sums(u)], expected, rtol=0, atol=1e-14)


def test_making_the_expressions_of_a_body_takes_work_in_proportion_to_its_fields() -> None:
    """Five modes are 21 fields, ten are 66; a matrix for every two fields takes their square."""
    few, many = calls_for(5), calls_for(10)
    assert many < 66 / 21 * 1.2 * few


def calls_for(n: int) -> int:
    """Return how many functions are called to make the expressions of a body of n modes."""
    q, v, a = (ca.SX.sym(name, n) for name in "qva")
    w, dw, u, at_origin = (ca.SX.sym(name, 3) for name in ("w", "dw", "u", "a"))
    motion, one = Motion(p=ca.SX(3, 1), R=ca.SX.eye(3), w=w, dw=dw, u=u, a=at_origin), body(n)
    counted = Counter[str]()
    before = sys.getprofile()
    sys.setprofile(lambda frame, event, what: counted.update([event]))
    try:
        elastic_forces.inertia_forces(one, motion, q, v, a, range(n))
    finally:
        sys.setprofile(before)
    return counted["call"]
