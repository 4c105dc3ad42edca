"""What a managed node answers when it is asked for a transition that its state does not have.

rclpy refuses a label that it does not find, but raises for an id: the node ends by it.
Life-cycle managers send ids; whoever leaves the request as it is sends 0.
"""

from __future__ import annotations

from typing import Any


def refuse_unknown_transitions(node: Any) -> None:
    """Let ``~/change_state`` of a node refuse, and log, an id that leads nowhere from where it is."""
    service: Any = node._service_change_state
    change = service.callback

    def on_change_state(request: Any, response: Any) -> Any:
        """Change the state, or say that it cannot be changed so."""
        machine, wanted = node._state_machine, request.transition
        allowed = {each[0]: f"{each[0]} ({each[1]})" for each in machine.available_transitions}
        if wanted.label or wanted.id in allowed:
            return change(request, response)
        said = f"change_state: transition.id: {wanted.id} is none of an {machine.current_state[1]} node"
        node.get_logger().error(f"{said}; allowed: {', '.join(allowed.values())}")
        response.success = False
        return response

    service.callback = on_change_state
