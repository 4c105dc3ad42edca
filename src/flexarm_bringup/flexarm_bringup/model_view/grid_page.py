"""What ``flexarm model --grid`` says: how far every mode goes over the poses, followed by its shape."""

from __future__ import annotations

import numpy as np

from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.tracking import UNCLEAR
from flexarm_model.served.pose_grid import PoseGrid
from flexarm_model.settings.units import RAD_PER_HZ

HEADS = (
    Column("mode", "d"), Column("lowest\n[Hz]", ".4g"), Column("at"), Column("highest\n[Hz]", ".4g"),
    Column("at"), Column("least MAC to\na neighbour", ".3f"), Column("unclear\nlinks", "d"),
)  # fmt: skip


def grid_page(config: ManipulatorConfig, grid: PoseGrid) -> Page:
    """Return the page of the modes of a grid of poses."""
    omega = np.array([model.omega for model in grid.models]) / RAD_PER_HZ  # (poses, n_eta)
    mac = np.array([link.mac for link in grid.links]).reshape(-1, omega.shape[1])
    poses = [", ".join(f"{value:.3g}" for value in model.pose) for model in grid.models]
    rows: list[Cells] = []
    for k, of_mode in enumerate(omega.T):
        low, high = int(of_mode.argmin()), int(of_mode.argmax())
        worst = float(mac[:, k].min()) if len(mac) else None
        unclear = int((mac[:, k] < UNCLEAR).sum())
        rows.append([k + 1, of_mode[low], poses[low], of_mode[high], poses[high], worst, unclear])
    notes = [
        "modes are followed from neighbour to neighbour by their shape: 1 need not be the slowest everywhere",
        f"unclear: MAC below {UNCLEAR:g}, as where two frequencies meet",
    ]
    if grid.refused:
        pose, why = grid.refused[0]
        at = ", ".join(f"{value:.3g}" for value in pose)
        notes.append(f"{len(grid.refused)} poses have no model, the first at {at}: {why}")
    table = Table(f"Modes over {len(grid.models)} poses [{', '.join(config.actuated)}]", HEADS, rows, notes)
    return Page(
        f"{config.name}: modes over poses", "Served models of a grid within the axes' ranges.", [table]
    )
