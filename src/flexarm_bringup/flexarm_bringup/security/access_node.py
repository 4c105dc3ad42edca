"""What every node of a running graph uses, asked of the graph itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from flexarm_bringup.rig_run.watch_node import WatchNode, watching
from flexarm_bringup.security.policy import NodeAccess
from flexarm_bringup.topics import NAMESPACE

SETTLED = 1.0  # s without anything new


def access_of(
    names: Sequence[str], is_late: Callable[[], bool], say: Callable[[str], None]
) -> tuple[NodeAccess, ...]:
    """Wait until the nodes are ready and nothing new appears; return what they use, without the asker.

    Args:
        names: Nodes in the namespace of flexarm.
        is_late: Whether to give up.
        say: Told who has become ready.

    Raises:
        TimeoutError: They did not become ready.
    """
    with watching(names, say) as node:
        while not all(node.ready.values()):
            node.spin(0.05)
            if is_late():
                missing = ", ".join(name for name, is_ready in node.ready.items() if not is_ready)
                raise TimeoutError(f"not ready: {missing}")
        before: tuple[NodeAccess, ...] = ()
        while (now := tuple(_asked(node, name) for name in names)) != before:
            before = now
            for _ in range(20):
                node.spin(SETTLED / 20)
    return before


def _asked(node: WatchNode, name: str) -> NodeAccess:
    def names(ask: Callable[[str, str], list[tuple[str, list[str]]]]) -> tuple[str, ...]:
        """Return names of topics or services of the node."""
        return tuple(sorted(found for found, _ in ask(name, NAMESPACE)))

    return NodeAccess(
        name,
        names(node.get_publisher_names_and_types_by_node),
        names(node.get_subscriber_names_and_types_by_node),
        names(node.get_service_names_and_types_by_node),
        names(node.get_client_names_and_types_by_node),
    )
