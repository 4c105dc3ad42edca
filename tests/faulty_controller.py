"""The controller node with a law that sleeps or raises now and then, for tests over DDS; not a test itself.

The environment says what: FAULTY_EVERY (answers to states), FAULTY_SLEEP [s], FAULTY_RAISES (any text). The
time at which every command leaves goes to the file FAULTY_LOG, one per line [s].
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from typing import Any, cast

from flexarm_controller import laws
from flexarm_controller.answer import Outgoing
from flexarm_controller.controller_node import ControllerNode
from flexarm_model.ros.node import run_node

EVERY = int(os.environ["FAULTY_EVERY"])
SLEEP = float(os.environ.get("FAULTY_SLEEP", "0"))
RAISES = os.environ.get("FAULTY_RAISES", "")


class FaultyLaw:
    """A law with a fault in every so many answers to states."""

    is_live = False  # the check of the margins asks it, too

    def __init__(self, law: laws.Planner) -> None:
        self._law, self._answers = law, 0

    def step(self, *arguments: Any) -> Any:
        self._answers += FaultyLaw.is_live
        if FaultyLaw.is_live and self._answers % EVERY == 0:
            time.sleep(SLEEP)
            if RAISES:
                raise RuntimeError(RAISES)
        return self._law.step(*arguments)

    def work_ahead(self) -> None:
        self._law.work_ahead()


class FaultyController(ControllerNode):
    """Notes when its commands leave."""

    def __init__(self) -> None:
        self._log = open(os.environ["FAULTY_LOG"], "w", buffering=1, encoding="utf8")  # noqa: SIM115
        super().__init__()
        self._sound, self.exchange.on_state = self.exchange.on_state, self._answer  # type: ignore

    def _answer(self, told: Any) -> list[Outgoing]:
        FaultyLaw.is_live = True
        try:
            return self._sound(told)
        finally:
            FaultyLaw.is_live = False

    def _publish(self, outgoing: Sequence[Outgoing]) -> None:
        if any(out.topic == "joint_commands" for out in outgoing):
            self._log.write(f"{time.perf_counter():.6f}\n")
        super()._publish(outgoing)


if __name__ == "__main__":
    table = cast("dict[str, Any]", laws.LAWS)
    sound = table["mpc"]
    table["mpc"] = lambda model, given: FaultyLaw(sound(model, given))
    sys.exit(run_node(FaultyController))
