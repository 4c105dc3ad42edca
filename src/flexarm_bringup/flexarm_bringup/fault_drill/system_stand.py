"""The stand for rows with nodes: the machine as processes in ROS domains that nobody else uses."""

from __future__ import annotations

import os
from functools import cached_property
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from flexarm_bringup.fault_drill.stand import Skipped, Stand

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_stand_node import LiveStand
    from flexarm_bringup.fault_drill.nodes_stand import NodesStand


class SystemStand:
    """One machine; what its rows start runs in folders of its own, which go when the stand goes."""

    def __init__(self, stand: Stand, folder: Path | None = None) -> None:
        """Use the tour of ``stand``; logs and bags go to ``folder`` (None: a temporary one)."""
        self.stand = stand
        self._temporary = None if folder else TemporaryDirectory(prefix="flexarm_faults_")
        self._root = folder or Path(self._temporary.name if self._temporary else "")
        self._runs = count()

    @property
    def name(self) -> str:
        """Name of the manipulator."""
        return self.stand.name

    def folder(self) -> Path:
        """Return a new empty folder."""
        folder = self._root / str(next(self._runs))
        folder.mkdir(parents=True)
        return folder

    @cached_property
    def nodes(self) -> NodesStand:
        """Rig, model, estimator, controller and guard as nodes in lockstep."""
        from flexarm_bringup.fault_drill.nodes_stand import NodesStand
        from flexarm_bringup.sessions import free_domains

        return NodesStand(self.stand, self.folder(), free_domains())

    def live(self) -> LiveStand:
        """Return a stand whose estimator is a node; use it with ``with``."""
        from flexarm_bringup.fault_drill.live_stand_node import LiveStand

        return LiveStand(self.stand, self.folder())

    def need_root(self) -> None:
        """Raise Skipped where the user is not root."""
        if os.geteuid() != 0:
            raise Skipped("needs root")
