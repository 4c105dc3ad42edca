"""A tolerance that holds for no field is refused: with a slip in its name a bound would stay loose unseen."""

from __future__ import annotations

from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.bags.bag_reader import check_bag, decode  # noqa: E402
from flexarm_bringup.regress.case import Case, read_case  # noqa: E402
from flexarm_bringup.regress.pinned import Pinned  # noqa: E402
from flexarm_bringup.regress.tolerance_check import check_tolerances, compared_fields  # noqa: E402
from flexarm_bringup.replaying.compare import TOLERANCES, Tolerance  # noqa: E402

CASES = Path(__file__).parents[3] / "tests" / "golden"
UNSAID = Pinned(Path("bag"), {}, {})


def check(*patterns: str) -> None:
    """Check a case with these tolerances before those that ship."""
    tolerances = (*(Tolerance(pattern, 1e-13, 0.0) for pattern in patterns), *TOLERANCES)
    check_tolerances(Case(Path("case"), "", UNSAID, UNSAID, tolerances))


def test_what_ships_and_what_the_golden_cases_hold_is_accepted() -> None:
    check()
    for case in sorted(path for path in CASES.iterdir() if path.is_dir()):
        check_tolerances(read_case(case))


@pytest.mark.parametrize(
    ("pattern", "meant"),
    [
        ("end_effector.pose.pose.position", "end_effector.pose.pose.position.x"),
        ("/flexarm/modal_state.theta", "modal_state.theta"),
        ("modal_state.sensors[0].innovation", "modal_state.sensors.innovation"),
        ("joint_comands.effort", "joint_commands.effort"),
        ("modal_state", "of model, modal_state, end_effector, joint_commands, "),
        ("joint_states.position", "of model, modal_state, end_effector, joint_commands, "),
    ],
)
def test_a_pattern_that_fits_no_compared_field_is_refused_with_what_may_be_meant(
    pattern: str, meant: str
) -> None:
    """Each was accepted, and the bound of a later pattern held."""
    with pytest.raises(ValueError) as caught:
        check("model.mass", pattern)
    place, said = "case/expect.yaml: tolerances.1.field", str(caught.value)
    assert said.startswith(f"{place}: '{pattern}': fits no field that is compared")
    assert meant in said


@pytest.mark.parametrize(
    "patterns", [("modal_state.*a", "modal_state.eta"), ("model.d*", "model.*", "model.[k-n]*")]
)
def test_a_pattern_behind_others_that_fit_all_of_its_fields_is_refused(patterns: tuple[str, ...]) -> None:
    *_, last = patterns
    with pytest.raises(ValueError) as caught:
        check(*patterns)
    place = f"case/expect.yaml: tolerances.{len(patterns) - 1}.field: '{last}'"
    assert str(caught.value).startswith(f"{place}: those before it fit each of its fields")


def test_a_pattern_of_which_one_field_is_left_is_accepted() -> None:
    check("modal_state.theta", "end_effector.pose.pose.position.*", "controller_debug.tip.x")


def test_fields_are_called_as_the_comparison_calls_them() -> None:
    """Every value of a message is found under the names, and nothing else is."""
    bag = check_bag(CASES / "single_link" / "golden")
    for topic in ("model", "modal_state", "end_effector"):
        message = decode(next(record for record in bag.records if record.name == f"/flexarm/{topic}"))
        names = [name.partition(".")[2] for name in compared_fields() if name.startswith(f"{topic}.")]
        for name in names:
            value = message
            for part in name.split("."):
                value = getattr(value[0] if isinstance(value, list) else value, part)
            assert not hasattr(value, "__dataclass_fields__"), name
        tops = {name for name in message.__dataclass_fields__ if name.islower() and name[0] != "_"}
        assert {name.partition(".")[0] for name in names} == tops
