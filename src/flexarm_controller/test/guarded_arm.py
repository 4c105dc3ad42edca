"""An arm of two axes for the guard's tests: a light one and a heavy one, nothing coupled, nothing to hold."""

import math
from dataclasses import replace

from flexarm_controller.guard import Braking, Guard, GuardCommand, GuardLimits, GuardState, Loads
from flexarm_controller.guarding.rest_watch import REST_TIME

TOKEN = 7
WEIGHTLESS = Loads(
    pose=(0.0, 0.0),
    holding=(0.0, 0.0),
    stiffness=((0.0, 0.0), (0.0, 0.0)),
    inertia=((0.1, 0.0), (0.0, 0.5)),
    turning=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    slowing=((0.0, 0.0), (0.0, 0.0)),
    reach=(0.4, 0.4),
    fastest=(math.inf, math.inf),
)
LIMITS = GuardLimits(
    effort=(2.0, 5.0),
    effort_rate=(100.0, 400.0),
    braking=Braking(deceleration=(5.0, 4.0), peak=(15.0, 8.0), taper=50.0, rate=10.0, lead=0.01),
    loads=WEIGHTLESS,
    period=0.005,
)
STEP = tuple(rate * LIMITS.period for rate in LIMITS.effort_rate)
REST = GuardState((0.0, 0.0), (0.0, 0.0))
MOVING = GuardState((1.0, -0.5), (0.0, 0.0))


def armed(t=0.0, **changes):
    """Return an armed guard with some limits changed."""
    guard = Guard(replace(LIMITS, **changes))
    assert guard.arm(t, TOKEN)
    return guard


def stand(guard, t=0.0, state=REST):
    """Let an arm stand still under a guard for as long as it takes until that counts as rest; return when."""
    periods = round(REST_TIME / guard.limits.period)
    for k in range(periods):
        guard.step(None, state, t + k * guard.limits.period)
    return t + periods * guard.limits.period


def command(t, sequence=1, effort=(0.3, 0.1), token=TOKEN, model_id=""):
    """Return a command of the session."""
    return GuardCommand(t, sequence, token, effort, model_id)
