"""Measurements with known modes, for the tests of ``flexarm identify``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy import signal

from flexarm_model.modal.frf import Ports, exact_frf
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linear_assembly import assemble

F_HZ, ZETA = np.array([12.0, 31.0]), np.array([0.02, 0.015])
STIFFNESS, TIP_MASS = "bodies.strip.pieces.0.youngs_modulus", "bodies.strip.point_masses.0.mass"


def softer_strip(path: Path) -> Path:
    """Write the responses of a strip with 25 % less stiffness and 30 % more mass at its tip."""
    changes = {STIFFNESS: "156.375 GPa", TIP_MASS: "70.2 g"}
    built = assemble(load_config(find_manipulator("single_link"), "geared", changes))
    ports = Ports(built.B, np.vstack([built.B.T, built.node_rows("strip.sensor")[1:2]]))
    lines = np.arange(0.0, 150.0, 0.05)
    clean = exact_frf(lines[1:], (built.M, built.D, built.K), ports, "accelerance").H[:, :, 0]
    rng = np.random.default_rng(2)
    noise = rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape)
    noisy = clean + 0.003 * np.median(abs(clean), axis=0) * noise
    names = {f"{name}/torque": np.append(0.0, column) for name, column in zip("ab", noisy.T, strict=True)}
    np.savez(path, f_hz=lines, **names)
    return path


def record(path: Path, seconds: float = 60.0, rate_hz: float = 200.0) -> Path:
    rng, omega = np.random.default_rng(1), 2 * np.pi * F_HZ
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    x = rng.standard_normal(t.size)
    y = np.zeros((t.size, 2))
    for k in range(2):
        b, a, _ = signal.cont2discrete(
            ([1.0, 0.0, 0.0], [1.0, 2 * ZETA[k] * omega[k], omega[k] ** 2]), 1 / rate_hz, method="bilinear"
        )
        y += np.outer(signal.lfilter(b.ravel(), a, x), [1.0, 0.7 - k])
    y += 0.02 * y.std() * rng.standard_normal(y.shape)
    np.savez(path, **{"t": t, "in:force": x, "out:a": y[:, 0], "out:b": y[:, 1]})
    return path
