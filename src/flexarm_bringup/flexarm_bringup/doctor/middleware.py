"""What carries the messages, and the files of settings that it is given."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.doctor.profiles import look_at_profiles
from flexarm_bringup.installed import middlewares

CHOICE = "RMW_IMPLEMENTATION"
WISHES = (CHOICE, "RCL_ASSERT_RMW_ID_MATCHES")  # rcl ends the process where one is not what it found
SUBJECT = "middleware"


def look_at_middleware(environment: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    """Yield whether there is the one that is asked for, and the files of profiles that are named."""
    yield _implementation(environment)
    yield from look_at_profiles(environment)


def _implementation(environment: Mapping[str, str]) -> Finding:
    """Return whether rcl would go on; asked itself it ends the process that asks, with code 1 or 102.

    Source: rcl 9.2.8, rmw_implementation_identifier_check.c.
    """
    installed = middlewares(environment)
    told = f"installed: {', '.join(installed) or 'none'}"
    wanted = {name: environment[name] for name in WISHES if environment.get(name)}
    for name, value in wanted.items():
        if value not in installed:
            take = f"export {name}={installed[0]}, or install" if installed else "install"
            return Finding(
                "FAULT", SUBJECT, f"{name}: '{value}': no such middleware; {told}", f"{take} {value}"
            )
    if not installed:
        return Finding("FAULT", SUBJECT, told, "./flexarm build, or source install/setup.bash")
    if len(set(wanted.values())) > 1:
        differ = " and ".join(f"{name}: '{value}'" for name, value in wanted.items())
        return Finding("FAULT", SUBJECT, f"{differ}: ROS starts nothing", f"unset {WISHES[1]}")
    return Finding("ok", SUBJECT, f"{environment.get(CHOICE) or 'that which ROS takes by itself'}; {told}")
