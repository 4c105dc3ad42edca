"""What row 19 counts: of a topic of which the newest message is enough, and of one that loses some."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from flexarm_bringup.fault_drill.drill import stand_of  # noqa: E402
from flexarm_bringup.fault_drill.message_rows import fuzz  # noqa: E402
from flexarm_bringup.fault_drill.message_stand import ExchangeLink, MessageStand, Recorded  # noqa: E402
from flexarm_bringup.fault_drill.stand import Stand  # noqa: E402

pytestmark = pytest.mark.slow


class LateLink(ExchangeLink):
    """An estimator that looks at its messages once a period, and finds the newest of some topics only."""

    def __init__(self, stand: Recorded, keeps: tuple[str, ...], newest_only: tuple[str, ...]) -> None:
        super().__init__(stand)
        self.newest_only = newest_only  # type: ignore[assignment]
        self._keeps, self._waiting = keeps, dict[str, Any]()

    def send(self, topic: str, msg: Any) -> None:
        if topic in self._keeps:
            self._waiting[topic] = msg
        else:
            super().send(topic, msg)

    def estimate(self, stamp_ns: int) -> Any:
        for topic, msg in self._waiting.items():
            super().send(topic, msg)
        self._waiting.clear()
        return super().estimate(stamp_ns)


@dataclass(frozen=True)
class Linked:
    """A stand with another link."""

    stand: Stand
    make_link: Callable[[Recorded], LateLink]

    @property
    def messages(self) -> MessageStand:
        return MessageStand(self.stand, self.make_link)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stand, name)


@pytest.mark.parametrize(
    ("keeps", "passes"), [((), True), (("joint_states",), True), (("joint_states", "strain"), False)]
)
def test_only_messages_that_need_not_be_taken_may_be_lost_uncounted(
    keeps: tuple[str, ...], passes: bool
) -> None:
    def link(stand: Recorded) -> LateLink:
        return LateLink(stand, keeps, ("joint_states",))

    found = {f.what: f.passed for f in fuzz(Linked(stand_of("single_link"), link))}  # type: ignore[arg-type]
    assert found.pop("refused / certainly bad, least of a topic") == passes
    assert all(found.values())
