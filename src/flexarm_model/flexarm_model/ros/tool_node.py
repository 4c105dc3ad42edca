"""The ROS domain as a command-line tool opens it: with the security that the environment asks for, or not."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions

from flexarm_model.process.security import (
    TOOLS,
    SecurityError,
    check_security,
    is_security_asked_for,
    told_of_security,
    with_enclave,
)
from flexarm_model.ros.node import expect_refusals

NO_LOG_FILE = ("--ros-args", "--disable-external-lib-logs")  # a stop must not hang on a folder for logs


@contextmanager
def in_domain(enclave: str = TOOLS) -> Iterator[None]:
    """Open the ROS domain of the environment; signals are left to the tool, Ctrl-C raises.

    Args:
        enclave: Of the tool, where security is asked for.

    Raises:
        SecurityError: It is asked for and cannot be had; also where that turns out with the first node.
    """
    arguments = with_enclave([*sys.argv[:1], *NO_LOG_FILE], enclave)
    check_security(arguments)
    expect_refusals()
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        yield
    except rclpy_implementation.RCLError as error:
        if not is_security_asked_for():
            raise
        raise SecurityError(told_of_security(str(error))) from error
    finally:
        rclpy.try_shutdown()
