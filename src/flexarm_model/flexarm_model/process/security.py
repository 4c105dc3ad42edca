"""DDS-Security that the environment asks for: can it be had, and the enclave of a process. Without ROS.

rcl takes only ROS_SECURITY_ENABLE=true, in these letters, for asking; and where ROS_SECURITY_STRATEGY is not
exactly Enforce it goes on unsecured with whatever it does not find. Nobody is told either. So everything that
opens a ROS domain asks here first, and ends where security is asked for and cannot be had.

The enclave of a node, the folder of its keys in the keystore, is its full name, of command-line tools
/flexarm/tools; ``--enclave`` and ROS_SECURITY_ENCLAVE_OVERRIDE win.
Source: rcl 9.2.8, security.c, and design.ros2.org, "ROS 2 Security Enclaves".
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from flexarm_model.process.enclave_keys import missing_keys
from flexarm_model.process.ros_arguments import values_of

TOOLS = "/flexarm/tools"
ENABLE, STRATEGY, KEYSTORE = "ROS_SECURITY_ENABLE", "ROS_SECURITY_STRATEGY", "ROS_SECURITY_KEYSTORE"
OVERRIDE = "ROS_SECURITY_ENCLAVE_OVERRIDE"
ENFORCE = "Enforce"
OFF = f"or export {ENABLE}=false to run without security"
_OPTIONS = ("-e", "--enclave")


class SecurityError(ValueError):
    """Security is asked for and cannot be had; the message says what is set, what it means, what to do."""


def is_security_asked_for(environment: Mapping[str, str] = os.environ) -> bool:
    """Say whether anybody who set the variables wants security, also where rcl would not understand him."""
    return environment.get(ENABLE, "").lower() not in ("", "false")


def with_enclave(
    arguments: Sequence[str], enclave: str, environment: Mapping[str, str] = os.environ
) -> list[str]:
    """Return a command line with an enclave, where security is asked for and it names none."""
    is_named = not is_security_asked_for(environment) or any(values_of(arguments, _OPTIONS))
    return [*arguments] if is_named else [*arguments, "--ros-args", "--enclave", enclave]


def check_security(arguments: Sequence[str], environment: Mapping[str, str] = os.environ) -> None:
    """Check that a process gets the security that is asked for; libraries are not looked at.

    Args:
        arguments: Its command line, with its enclave.
        environment: Of the process.

    Raises:
        SecurityError: It would run unsecured, or rcl would refuse it.
    """
    if not is_security_asked_for(environment):
        return
    asked, strategy = environment[ENABLE], environment.get(STRATEGY, "")
    if asked != "true":
        raise SecurityError(
            f"{ENABLE}: '{asked}': ROS takes it for no and runs unsecured; export {ENABLE}=true, {OFF}"
        )
    if strategy != ENFORCE:
        means = f"with {ENABLE}=true, ROS runs unsecured where keys are missing"
        raise SecurityError(f"{STRATEGY}: '{strategy}': {means}; export {STRATEGY}={ENFORCE}, {OFF}")
    store = environment.get(KEYSTORE, "")
    if not os.path.isdir(store):
        means = f"no folder of keys, and {ENABLE}=true asks for them"
        raise SecurityError(f"{KEYSTORE}: '{store}': {means}; make one as flexarm security says, {OFF}")
    enclave = environment.get(OVERRIDE) or next(reversed([*values_of(arguments, _OPTIONS)]), "/")
    folder = Path(store, "enclaves", enclave.strip("/"))
    if lacking := missing_keys(folder):
        lacks = f"no {', '.join(lacking)} for" if folder.is_dir() else "it has no keys for"
        means = f"{lacks} the enclave {enclave}, and {ENABLE}=true asks for them"
        make = (
            f"ros2 security create_enclave {store} {enclave}, then create_permission as flexarm security says"
        )
        raise SecurityError(f"{KEYSTORE}: '{store}': {means}; {make} (without it may do anything), {OFF}")


def check_unsecured(environment: Mapping[str, str] = os.environ) -> None:
    """Check that nodes can be run in a ROS domain of their own, for which there are no keys.

    Raises:
        SecurityError: Security is asked for.
    """
    if is_security_asked_for(environment):
        means = "this runs nodes in a domain of its own, on this machine only, for which there are no keys"
        raise SecurityError(f"{ENABLE}: '{environment[ENABLE]}': {means}; export {ENABLE}=false for it")


def told_of_security(reason: str, environment: Mapping[str, str] = os.environ) -> str:
    """Return in one line why rcl refused, with what to do where that is the security that was asked for."""
    line = " ".join(reason.split())
    is_security = is_security_asked_for(environment) and "security" in line.lower()
    return f"{line}: {ENABLE}=true asks for it; install a DDS that has it, {OFF}" if is_security else line
