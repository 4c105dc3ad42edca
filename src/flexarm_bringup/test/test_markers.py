"""Markers of a bent arm as a viewer gets them, without a node."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("visualization_msgs", reason="needs ROS")

from visualization_msgs.msg import Marker  # noqa: E402

from flexarm_bringup.display.conversions import markers_msg  # noqa: E402
from flexarm_bringup.display.ellipsoid import Ellipsoid, three_sigma  # noqa: E402
from flexarm_bringup.model_view.mechanism_lines import Line  # noqa: E402
from flexarm_model.numeric.rotation import rotation_from_quaternion  # noqa: E402

TIP = np.array([0.45, 0.45, 0.0])


def around_the_tip(doubt: Ellipsoid | None) -> Marker:
    line = Line("arm", np.array([np.zeros(3), TIP]))
    markers = markers_msg([line], frozenset(), np.zeros((1, 3)), TIP, doubt).markers
    return next(marker for marker in markers if marker.ns == "tip, 3 sigma")


def test_the_ellipsoid_is_as_long_and_as_thin_as_the_covariance_and_turned_with_it() -> None:
    along, covariance = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0), np.zeros((3, 3))
    covariance += (1.6e-3 / 3.0) ** 2 * np.outer(along, along)
    marker = around_the_tip(three_sigma(covariance))
    turn, scale = marker.pose.orientation, marker.scale
    axes = rotation_from_quaternion((turn.x, turn.y, turn.z, turn.w))
    assert marker.action == Marker.ADD
    assert [scale.x, scale.y, scale.z] == pytest.approx([1e-4, 1e-4, 3.2e-3])
    assert abs(axes[:, 2] @ along) == pytest.approx(1.0)


def test_an_ellipsoid_that_is_not_known_is_taken_away() -> None:
    """The last one stayed."""
    assert around_the_tip(None).action == Marker.DELETE
