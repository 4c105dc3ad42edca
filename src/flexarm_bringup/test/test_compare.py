"""Two bags are equal within their tolerances, or the first difference is named."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_fixture import PERIOD_NS, modal_state, write_bag
from hypothesis import given
from hypothesis import strategies as st

from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.replaying.compare import IGNORED, Comparison, Tolerance, _agree, _agreeing, compare_bags

JOINTS, MODAL = "/flexarm/joint_states", "/flexarm/modal_state"


def compare(
    tmp_path: Path, tolerances: tuple[Tolerance, ...] = (), ticks: int = 2, **changes: Any
) -> Comparison:
    golden = check_bag(write_bag(tmp_path / "golden", 2))
    other = check_bag(write_bag(tmp_path / "other", ticks, **changes))
    return compare_bags(golden, other, [JOINTS, MODAL], tolerances)


def test_a_bag_equals_its_copy(tmp_path: Path) -> None:
    result = compare(tmp_path)
    assert result.is_equal
    assert result.compared == {JOINTS: 2, MODAL: 2}


def test_the_first_divergence_has_stamp_topic_and_field(tmp_path: Path) -> None:
    result = compare(tmp_path, eta=[1e-3, 2.5e-3])
    assert len(result.divergences) == 1
    first = result.divergences[0]
    assert (first.stamp_ns, first.topic, first.field) == (PERIOD_NS, MODAL, "eta[1]")
    assert str(first) == "0.005000000 s  /flexarm/modal_state.eta[1]: 0.0025, 0.002 expected"


def test_a_nested_field_is_named_with_its_indices(tmp_path: Path) -> None:
    assert compare(tmp_path, rejected=1).divergences[0].field == "sensors[0].rejected"


@pytest.mark.parametrize(
    ("tolerance", "is_equal"),
    [
        (Tolerance("modal_state.eta", 0.9e-6, 0.0), False),
        (Tolerance("modal_state.eta", 1.1e-6, 0.0), True),
        (Tolerance("modal_state.eta", 0.0, 0.9e-3), False),
        (Tolerance("modal_state.eta", 0.0, 1.1e-3), True),
        (Tolerance("modal_state.*", 1.1e-6, 0.0), True),
        (Tolerance("modal_state.eta_dot", 1.0, 0.0), False),
        (Tolerance("end_effector.*", 1.0, 0.0), False),
    ],
)
def test_the_tolerance_is_absolute_plus_relative(
    tmp_path: Path, tolerance: Tolerance, is_equal: bool
) -> None:
    result = compare(tmp_path, (tolerance,), eta=[1e-3 + 1e-6, 2e-3])
    assert result.is_equal is is_equal


def test_a_number_that_is_not_finite_never_agrees_with_one_that_is(tmp_path: Path) -> None:
    wide = (Tolerance("modal_state.*", 1e300, 1e300),)
    assert not compare(tmp_path, wide, eta=[float("nan"), 2e-3]).is_equal


def test_an_ignored_field_may_hold_anything(tmp_path: Path) -> None:
    ignored = (Tolerance("modal_state.reason", IGNORED, 0.0),)
    assert compare(tmp_path, ignored, reason="other").is_equal


def test_text_and_counts_have_no_tolerance(tmp_path: Path) -> None:
    wide = (Tolerance("modal_state.*", 1e9, 1.0),)
    assert not compare(tmp_path, wide, reason="other").is_equal


def test_an_array_of_other_length_differs(tmp_path: Path) -> None:
    result = compare(tmp_path, eta=[1e-3])
    assert result.divergences[0].text == "1 element(s), 2 expected"


def without(bag: Bag, topic: str, stamp_ns: int) -> Bag:
    kept = [r for r in bag.records if (r.name, r.log_time_ns) != (topic, stamp_ns)]
    return replace(bag, records=tuple(kept))


def restamped(bag: Bag, topic: str, stamp_ns: int, later_ns: int) -> Bag:
    """Return the bag with another stamp, and another number, in one message."""
    cdr = modal_state(stamp_ns + later_ns, eta=[5.0, 2e-3])
    records = [
        replace(r, cdr=cdr) if (r.name, r.log_time_ns) == (topic, stamp_ns) else r for r in bag.records
    ]
    return replace(bag, records=tuple(records))


def test_messages_missing_or_too_many_are_named(tmp_path: Path) -> None:
    whole = check_bag(write_bag(tmp_path / "bag", 4))
    less = without(whole, MODAL, PERIOD_NS)
    for expected, found, text in (
        (whole, less, "1 message(s) missing"),
        (less, whole, "1 message(s) too many"),
    ):
        result = compare_bags(expected, found, [JOINTS, MODAL])
        assert [(d.stamp_ns, d.topic, d.text) for d in result.divergences] == [(PERIOD_NS, MODAL, text)]


def test_a_recording_may_end_in_the_middle_of_an_instant(tmp_path: Path) -> None:
    whole = check_bag(write_bag(tmp_path / "bag", 4))
    cut = without(whole, MODAL, 3 * PERIOD_NS)
    assert compare_bags(cut, whole, [JOINTS, MODAL]).is_equal
    longer = check_bag(write_bag(tmp_path / "longer", 6))
    assert compare_bags(whole, longer, [JOINTS, MODAL]).is_equal
    assert not compare_bags(longer, whole, [JOINTS, MODAL]).is_equal


def test_a_node_that_ended_just_before_the_others_may_go_on_in_the_other_bag(tmp_path: Path) -> None:
    whole = check_bag(write_bag(tmp_path / "bag", 20))
    cut = without(without(whole, MODAL, 19 * PERIOD_NS), MODAL, 18 * PERIOD_NS)
    assert compare_bags(cut, whole, [JOINTS, MODAL]).is_equal
    early = cut
    for k in range(5, 18):
        early = without(early, MODAL, k * PERIOD_NS)
    assert not compare_bags(early, whole, [JOINTS, MODAL]).is_equal
    assert not compare_bags(whole, cut, [JOINTS, MODAL]).is_equal


def test_replays_of_one_bag_are_compared_to_their_last_message(tmp_path: Path) -> None:
    whole = check_bag(write_bag(tmp_path / "bag", 20))
    cut = without(whole, MODAL, 19 * PERIOD_NS)
    late = restamped(whole, MODAL, 19 * PERIOD_NS, 7_000_000)
    for expected, found in ((cut, whole), (whole, cut), (whole, late)):
        result = compare_bags(expected, found, [JOINTS, MODAL], free_end=False)
        assert {item.topic for item in result.divergences} == {MODAL}
        assert result.divergences[0].stamp_ns == 19 * PERIOD_NS
    assert compare_bags(whole, whole, [JOINTS, MODAL], free_end=False).is_equal


def test_of_the_last_instant_of_a_recording_any_part_may_be_missing_and_what_is_there_is_counted(
    tmp_path: Path,
) -> None:
    whole = check_bag(write_bag(tmp_path / "bag", 4))
    cut = without(whole, JOINTS, 3 * PERIOD_NS)
    for expected, found in ((whole, cut), (cut, whole)):
        result = compare_bags(expected, found, [JOINTS, MODAL])
        assert result.is_equal
        assert result.compared == {JOINTS: 3, MODAL: 4}


NUMBERS = st.one_of(st.floats(-2.0, 2.0), st.sampled_from([0.0, -0.0, 1e-9, np.inf, -np.inf, np.nan]))


@given(
    st.lists(st.tuples(NUMBERS, NUMBERS), max_size=8),
    st.sampled_from([0.0, 1e-9, 1.0, IGNORED]),
    st.booleans(),
)
def test_numbers_of_an_array_agree_as_each_does_by_itself(
    pairs: list[tuple[float, float]], atol: float, are_whole: bool
) -> None:
    tolerance = Tolerance("*", atol, 0.1)
    table = np.array([*pairs, *((a, a) for a, _ in pairs)]).reshape(-1, 2)
    a, b = (np.nan_to_num(table).clip(-2, 2).astype(np.int32) if are_whole else table).T
    assert _agreeing(a, b, tolerance).tolist() == [
        _agree(*pair, tolerance) for pair in zip(a, b, strict=True)
    ]
