"""Requests as users write them: filled field by field, or refused with the field and what is allowed."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
pytestmark = pytest.mark.ros

from flexarm_interfaces.srv import CancelMotion, MoveTip, SetNoise, SetState, ToggleSensor  # noqa: E402
from geometry_msgs.msg import PoseWithCovariance  # noqa: E402
from lifecycle_msgs.srv import ChangeState  # noqa: E402
from rcl_interfaces.msg import SetParametersResult  # noqa: E402
from rcl_interfaces.srv import ListParameters, SetParameters, SetParametersAtomically  # noqa: E402

from flexarm_bringup.calling import call_node  # noqa: E402
from flexarm_bringup.calling.request import RequestError, fill  # noqa: E402
from flexarm_model.settings.yaml_file import ConfigError, parse_yaml  # noqa: E402

ROOT = Path(__file__).parents[3]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
KINDS = {
    "controller/move_tip": MoveTip, "controller/cancel": CancelMotion, "controller/change_state": ChangeState,
    "estimator/set_noise": SetNoise, "estimator/set_state": SetState, "estimator/toggle_sensor": ToggleSensor,
}  # fmt: skip


def written() -> list[tuple[str, str]]:
    """Services and requests of the documentation, and of the command's own help."""
    texts = [*(page.read_text(encoding="utf8") for page in PAGES), call_node.__doc__ or ""]
    return [found for text in texts for found in re.findall(r'flexarm call (\S+) "([^"\n]*)"', text)]


@pytest.mark.parametrize(("service", "text"), written())
def test_a_request_that_is_written_down_is_one_of_its_service(service: str, text: str) -> None:
    fill(KINDS[service].Request(), parse_yaml(text, service))


def test_there_are_such_requests() -> None:
    assert len(written()) >= 6


def test_what_is_left_out_keeps_its_default_and_messages_within_messages_are_filled() -> None:
    request = MoveTip.Request()
    fill(request, parse_yaml("{target: {position: {x: 0.5, y: 1}}, with_orientation: true}", "it"))
    assert (request.target.position.x, request.target.position.y, request.target.position.z) == (
        0.5,
        1.0,
        0.0,
    )
    assert request.with_orientation and request.duration == 0.0 and request.target.orientation.w == 1.0


def test_lists_and_numbers_that_yaml_takes_for_texts_are_read() -> None:
    noise, state, cancel = SetNoise.Request(), SetState.Request(), CancelMotion.Request()
    fill(noise, {"name": "encoder", "value": ["1e-4", 2]})
    fill(state, {"state": {"theta": [0.1], "theta_sigma": [math.inf]}})
    fill(cancel, {"goal_id": 2**64 - 1})
    assert noise.name == "encoder" and list(noise.value) == [1e-4, 2.0]
    assert list(state.state.theta) == [0.1] and cancel.goal_id == 2**64 - 1


@pytest.mark.parametrize(
    ("kind", "values", "said"),
    [
        (
            MoveTip.Request,
            {"x": 1.0},
            r"the request has no field 'x'; its fields: target \(geometry_msgs/Pose",
        ),
        (MoveTip.Request, {"target": {"position": {"w": 1}}}, "target.position has no field 'w'"),
        (MoveTip.Request, {"target": [1.0]}, "target: .* expected a mapping, geometry_msgs/Pose"),
        (MoveTip.Request, {"duration": "long"}, "duration: 'long': expected double"),
        (MoveTip.Request, {"duration": True}, "duration: True: expected double"),
        (MoveTip.Request, {"duration": "nan"}, "duration: 'nan': expected double"),
        (MoveTip.Request, {"with_orientation": 1}, "expected true or false"),
        (ToggleSensor.Request, {"name": 3}, "name: 3: expected string"),
        (SetNoise.Request, {"value": 1.0}, "value: 1.0: expected a list of double"),
        (SetNoise.Request, {"value": [1.0, None]}, r"value\[1\]: None: expected double"),
        (CancelMotion.Request, {"goal_id": -1}, "goal_id: -1: expected uint64"),
        (CancelMotion.Request, {"goal_id": 2**64}, "expected uint64"),
        (CancelMotion.Request, {"goal_id": 1.0}, "expected uint64"),
        (PoseWithCovariance, {"covariance": [0.0] * 35}, "covariance: has 35 values: expected 36"),
    ],
)
def test_what_does_not_fit_is_refused_with_the_field_and_what_is_allowed(kind, values, said) -> None:
    with pytest.raises(RequestError, match=said):
        fill(kind(), values)


@pytest.mark.parametrize(
    ("text", "said"), [("1", "must hold keys"), ("{a: 1, a: 2}", "twice"), ("{", "YAML")]
)
def test_a_request_that_is_no_mapping_is_refused(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=f"the request: .*{said}"):
        parse_yaml(text, "the request")


def test_an_answer_that_tells_of_a_failure_is_one_whatever_its_field_is_called() -> None:
    """Of a parameter that cannot be set it was told with exit code 0."""
    done, failed = (SetParametersResult(successful=is_done) for is_done in (True, False))
    assert call_node.was_done(SetParameters.Response(results=[done, done]))
    assert not call_node.was_done(SetParameters.Response(results=[done, failed]))
    assert call_node.was_done(SetParametersAtomically.Response(result=done))
    assert not call_node.was_done(SetParametersAtomically.Response(result=failed))
    assert call_node.was_done(ListParameters.Response())
    assert not call_node.was_done(MoveTip.Response(accepted=False))
    assert not call_node.was_done(ChangeState.Response(success=False))
