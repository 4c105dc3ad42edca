"""Synthetic responses with known answers, for the fits."""

from __future__ import annotations

import numpy as np

from flexarm_model.modal.frf import Frf, Ports, exact_frf, modal_frf
from flexarm_model.modal.modes import Modes, damped_poles, poles_of

ZETA = 0.0232
FINE = np.arange(104.0, 154.1, 0.5)  # 25 Hz around 129 Hz, 0.5 Hz lines
# Planar 3RRR at pose A, seed 000: three triplets, the next modes above the band.
PLANAR_HZ = np.array(
    [1.4041, 1.6819, 1.9102, 13.6052, 13.8773, 14.5651, 20.2382, 20.4087, 20.7244, 54.9, 55.3]
)
LINES_3RRR = np.linspace(0.3125, 30.0, 96)  # Hz, a record of 3.2 s


def with_noise(frf: Frf, level_db: float, rng: np.random.Generator) -> Frf:
    """Return responses with white noise; the level is below the largest magnitude, as in seed 001."""
    noise = rng.standard_normal(frf.H.shape) + 1j * rng.standard_normal(frf.H.shape)
    return Frf(frf.f_hz, frf.H + abs(frf.H).max() * 10 ** (-level_db / 20) * noise / np.sqrt(2), frf.kind)


def rms_percent(values: list[np.ndarray], truth: np.ndarray) -> np.ndarray:
    return np.asarray(100 * np.sqrt(np.mean((np.array(values) / truth - 1) ** 2, axis=0)))


def pair(distance_hz: float) -> tuple[Modes, Frf]:
    """Return two modes about 129 Hz, one above the band, and three outputs of a force on both."""
    omega = 2 * np.pi * np.array([129 - distance_hz / 2, 129 + distance_hz / 2, 240.0])
    shapes = np.array([[1.0, 0.681, -0.3], [-1.0, 0.673, -0.1], [0.1, 0.289, 1.0]])
    modes = Modes(omega, 2 * ZETA * omega, shapes / np.linalg.norm(shapes, axis=0))
    force = modes.shapes[:, :2].sum(axis=1)
    return modes, modal_frf(FINE, modes, Ports(force[:, None], np.eye(3)))


def planar(seed: int, zeta: float = 0.01) -> tuple[Modes, Frf]:
    """Return a machine of three legs with close triplets, nine outputs and three inputs, 0.3125 Hz lines."""
    rng = np.random.default_rng(seed)
    blocks = []
    for _ in range(4):
        mixed = np.array([[1, 1, 1], [1, -1, 1], [1, 0, -2.0]]) + 0.2 * rng.standard_normal((3, 3))
        Q = np.linalg.qr(mixed)[0]
        blocks.append(np.vstack([Q, Q * rng.uniform(0.6, 2.0, (1, 3)), rng.standard_normal((3, 3)) / 2]))
    shapes = np.hstack(blocks)[:, : PLANAR_HZ.size]
    omega = 2 * np.pi * PLANAR_HZ
    modes = Modes(omega, 2 * zeta * omega, shapes)
    ports = Ports(np.eye(9)[:, :3], np.eye(9))
    return modes, modal_frf(LINES_3RRR, modes, ports, "accelerance").band(10.0, 27.0)


def poles_of_modes(modes: Modes) -> np.ndarray:
    return poles_of(modes.f_hz, modes.zeta)


def locally_damped() -> tuple[np.ndarray, Frf]:
    """Return the poles and responses of a chain with one damper: its modes are complex."""
    K = 4e3 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    M, D = np.diag([1.0, 1.3, 1.6, 2.0]), np.diag([8.0, 0.0, 0.0, 0.5])
    frf = exact_frf(np.arange(2.0, 30.0, 0.25), (M, D, K), Ports(np.eye(4)[:, :2], np.eye(4)))
    return damped_poles(M, D, K), frf
