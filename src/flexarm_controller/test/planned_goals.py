"""Goals of the tip that are planned and taken at once, as in lockstep."""

from flexarm_controller.motion.refusals import MotionError


def move_tip(server, goal, arm, state):
    """Return the answer of a motion server to a goal."""
    try:
        draft = server.draft(goal, arm, state)
    except MotionError as error:
        return server.reject(state.t, str(error))
    plan = server.planner.plan(draft)
    if isinstance(plan, MotionError):
        return server.reject(state.t, str(plan))
    return server.take(draft, plan, arm, state)
